#include "tools/export/render_tone.h"

#include <algorithm>
#include <cmath>

namespace enfilade {
namespace {

constexpr double kMiddle = 0.5;  // what the key is scaled to before the curve
constexpr double kWhite = 6;     // what the curve maps to 1
constexpr double kDarkest = 1e-3;

}  // namespace

double Luminance(const Rgb& linear) {
  return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2];
}

void ExposureMeter::Add(const Rgb& radiosity, double weight) {
  const double luminance = Luminance(radiosity);
  if (!(luminance > 0)) {
    return;
  }
  const double octave = std::log2(luminance) + kOctaves / 2.0;
  const double bin =
      std::clamp(octave * kBinsPerOctave, 0.0, kBinsPerOctave * kOctaves - 1.0);
  weights_[static_cast<size_t>(bin)] += weight;
}

double ExposureMeter::Key() const {
  const auto value = [](size_t bin) {
    return std::exp2((static_cast<double>(bin) + 0.5) / kBinsPerOctave -
                     kOctaves / 2.0);
  };
  double weight = 0;
  double sum = 0;
  for (size_t bin = 0; bin < weights_.size(); ++bin) {
    weight += weights_[bin];
    sum += weights_[bin] * value(bin);
  }
  if (!(weight > 0)) {
    return 1;
  }
  const double darkest = kDarkest * sum / weight;
  double lit_weight = 0;
  double logs = 0;
  for (size_t bin = 0; bin < weights_.size(); ++bin) {
    if (value(bin) >= darkest) {
      lit_weight += weights_[bin];
      logs += weights_[bin] * std::log(value(bin));
    }
  }
  return std::exp(logs / lit_weight);
}

ToneMap::ToneMap(double key, double stops)
    : scale_(kMiddle / key * std::exp2(stops)) {}

Rgb ToneMap::Linear(const Rgb& radiosity) const {
  Rgb result{};
  for (size_t c = 0; c < kRgbChannels; ++c) {
    const double x = std::max(0.0, radiosity[c]) * scale_;
    result[c] = std::min(1.0, x * (1 + x / (kWhite * kWhite)) / (1 + x));
  }
  return result;
}

std::array<uint8_t, 3> ToneMap::Encoded(const Rgb& radiosity) const {
  const Rgb linear = Linear(radiosity);
  return {EncodeSrgb(linear[0]), EncodeSrgb(linear[1]), EncodeSrgb(linear[2])};
}

uint8_t EncodeSrgb(double linear) {
  const double x = std::clamp(linear, 0.0, 1.0);
  const double encoded =
      x <= 0.0031308 ? 12.92 * x : 1.055 * std::pow(x, 1 / 2.4) - 0.055;
  return static_cast<uint8_t>(std::lround(encoded * 255));
}

}  // namespace enfilade
