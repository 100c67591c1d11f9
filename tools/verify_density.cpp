#include "tools/verify_density.h"

#include "base/check.h"
#include "base/random.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace enfilade {
namespace {

constexpr double kUniformShare = 0.15;
// Of what is not uniform, what goes on by the light alone: a pilot that met few
// of the brightest places knows too little of their noise.
constexpr double kLightShare = 0.4;
constexpr double kPriorPoints = 8;  // that a class borrows from all

}  // namespace

PointDensity::PointDensity(std::vector<LightBin> bins)
    : area_(bins.empty() ? 0 : bins.back().end), bins_(std::move(bins)) {
  ENFILADE_CHECK(area_ > 0, "no bins");
  for (const LightBin& bin : bins_) {
    mean_level_ += bin.level * (bin.end - bin.begin) / area_;
  }
  SetMasses([](const LightBin& bin) { return std::sqrt(bin.level); });
}

template <typename Density>
void PointDensity::SetMasses(const Density& density) {
  masses_.clear();
  double sum = 0;
  double light = 0;
  for (const LightBin& bin : bins_) {
    masses_.push_back(density(bin) * (bin.end - bin.begin));
    sum += masses_.back();
    light += std::sqrt(bin.level) * (bin.end - bin.begin);
  }
  for (size_t i = 0; i < bins_.size(); ++i) {
    const double length = bins_[i].end - bins_[i].begin;
    const double uniform = length / area_;
    const double learned = sum > 0 ? masses_[i] / sum : uniform;
    const double by_light =
        light > 0 ? std::sqrt(bins_[i].level) * length / light : uniform;
    masses_[i] = kUniformShare * uniform +
                 (1 - kUniformShare) *
                     (kLightShare * by_light + (1 - kLightShare) * learned);
  }
}

PointDensity::Draw PointDensity::Choose(uint32_t count, uint64_t key) const {
  Draw draw;
  size_t at = 0;
  double before = 0;  // probability of the bins before this one
  for (uint32_t i = 0; i < count; ++i) {
    Random random(MixKey(key, i));
    const double target = (i + random.Next()) / count;
    while (at + 1 < masses_.size() && target >= before + masses_[at]) {
      before += masses_[at++];
    }
    const double within =
        std::min((target - before) / masses_[at], 0x1.fffffffffffffp-1);
    const LightBin& bin = bins_[at];
    const double length = bin.end - bin.begin;
    draw.places.push_back(bin.begin + within * length);
    draw.weights.push_back(length / area_ / masses_[at]);
  }
  return draw;
}

size_t PointDensity::BinAt(double place) const {
  const auto after = std::upper_bound(
      bins_.begin(), bins_.end(), place, [](double p, const LightBin& bin) {
        return p < bin.begin;
      });
  return static_cast<size_t>(
             std::max(after - bins_.begin(), std::ptrdiff_t{1})) -
         1;
}

size_t PointDensity::ClassOf(double level) const {
  if (!(level > 0)) {
    return 0;
  }
  const double octaves = std::floor(std::log2(level / mean_level_));
  return static_cast<size_t>(
      std::clamp(octaves + kClasses / 2.0, 0.0, kClasses - 1.0));
}

void PointDensity::Learn(const Draw& draw, std::span<const double> values) {
  std::array<double, kClasses> squares{};
  std::array<double, kClasses> counts{};
  double all_squares = 0;
  for (size_t i = 0; i < values.size(); ++i) {
    const size_t k = ClassOf(bins_[BinAt(draw.places[i])].level);
    squares[k] += values[i] * values[i];
    counts[k] += 1;
    all_squares += values[i] * values[i] * draw.weights[i];
  }
  all_squares /= static_cast<double>(values.size());
  // Classes share with their neighbours: outliers are rare and strong.
  std::array<double, kClasses> roots{};
  for (size_t k = 0; k < kClasses; ++k) {
    double sum = kPriorPoints * all_squares;
    double count = kPriorPoints;
    for (size_t j = k > 0 ? k - 1 : 0; j < std::min(k + 2, kClasses); ++j) {
      const double share = j == k ? 1 : 0.5;
      sum += share * squares[j];
      count += share * counts[j];
    }
    roots[k] = std::sqrt(sum / count);
  }
  SetMasses([&](const LightBin& bin) { return roots[ClassOf(bin.level)]; });
}

}  // namespace enfilade
