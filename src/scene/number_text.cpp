#include "scene/number_text.h"

#include <charconv>
#include <cmath>
#include <cstdint>

namespace enfilade {
namespace {

template <typename Number>
bool Parses(std::string_view word, Number& value) {
  if (word.starts_with('+') && !word.starts_with("+-")) {
    word.remove_prefix(1);
  }
  const char* end = word.data() + word.size();
  const auto result = std::from_chars(word.data(), end, value);
  return result.ec == std::errc() && result.ptr == end;
}

}  // namespace

std::vector<std::string_view> Words(std::string_view line) {
  constexpr std::string_view kBlanks = " \t\r\n";
  std::vector<std::string_view> words;
  size_t at = line.find_first_not_of(kBlanks);
  while (at != std::string_view::npos) {
    const size_t end = line.find_first_of(kBlanks, at);
    words.push_back(line.substr(at, end - at));
    at = line.find_first_not_of(kBlanks, end);
  }
  return words;
}

bool IsNumber(std::string_view word) {
  return ToNumber(word).has_value();
}

std::optional<double> ToNumber(std::string_view word) {
  double value = 0;
  return Parses(word, value) && std::isfinite(value) ? std::optional(value)
                                                     : std::nullopt;
}

bool IsInteger(std::string_view word) {
  int32_t value = 0;
  return Parses(word, value);
}

}  // namespace enfilade
