#include "scene/instance_line.h"

#include "base/photometry.h"
#include "scene/number_text.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include <fmt/format.h>

namespace enfilade {
namespace {

constexpr size_t kLeastWords = 5;  // piece, three coordinates, angle
constexpr size_t kMostWords = 6;

struct SinCos {
  double sin = 0, cos = 1;
};

// Sine and cosine, exact for quarter turns.
SinCos SinCosOfDegrees(double degrees) {
  const double turn = std::remainder(degrees, 360.0);
  if (turn == 0) {
    return {0, 1};
  }
  if (std::abs(turn) == 90) {
    return {std::copysign(1.0, turn), 0};
  }
  if (std::abs(turn) == 180) {
    return {0, -1};
  }
  const double radians = turn * kPi / 180;
  return {std::sin(radians), std::cos(radians)};
}

bool StaysInFolder(const std::filesystem::path& path) {
  return path.is_relative() && path.has_filename() &&
         std::find(path.begin(), path.end(), "..") == path.end();
}

}  // namespace

InstancePlacement::InstancePlacement(Point3 origin,
                                     double angle_degrees,
                                     double scale)
    : origin_(origin), scale_(scale) {
  const SinCos turn = SinCosOfDegrees(angle_degrees);
  cos_ = scale * turn.cos;
  sin_ = scale * turn.sin;
}

std::optional<std::string_view> WordsAfterInstance(std::string_view line) {
  constexpr std::string_view kKey = "#instance";
  const size_t first = line.find_first_not_of(" \t");
  if (first == std::string_view::npos ||
      line.substr(first, kKey.size()) != kKey) {
    return std::nullopt;
  }
  const std::string_view rest = line.substr(first + kKey.size());
  if (!rest.empty() && rest.front() != ' ' && rest.front() != '\t') {
    return std::nullopt;  // a comment that begins with a longer word
  }
  return rest;
}

InstanceReading ReadInstance(std::string_view words_after) {
  const std::vector<std::string_view> words = Words(words_after);
  if (words.size() < kLeastWords || words.size() > kMostWords) {
    return {std::nullopt,
            fmt::format("an instance is '#instance PIECE.obj TX TY TZ ANGLE "
                        "[SCALE]', without blanks in the name; this one has "
                        "{} words after the keyword",
                        words.size())};
  }
  const std::filesystem::path piece(words[0]);
  if (!StaysInFolder(piece)) {
    return {std::nullopt,
            fmt::format("piece '{}' leaves the folder of the scene; give a "
                        "relative path without '..'",
                        words[0])};
  }
  std::array<double, kMostWords - 1> numbers = {0, 0, 0, 0, 1};
  for (size_t i = 1; i < words.size(); ++i) {
    const std::optional<double> number = ToNumber(words[i]);
    if (!number) {
      return {std::nullopt,
              fmt::format("'{}' is not a finite number", words[i])};
    }
    numbers[i - 1] = *number;
  }
  if (numbers[4] <= 0) {
    return {std::nullopt, fmt::format("scale {} is not above 0", words.back())};
  }
  return {
      Instance{piece,
               {{numbers[0], numbers[1], numbers[2]}, numbers[3], numbers[4]}},
      ""};
}

}  // namespace enfilade
