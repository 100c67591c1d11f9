// From radiosity to colours: exposure by the logarithmic mean, Reinhard's curve
// (Reinhard et al., "Photographic Tone Reproduction for Digital Images", 2002,
// eq. 4) and the sRGB transfer function.

#pragma once

#include "base/photometry.h"

#include <array>
#include <cstdint>

namespace enfilade {

// Luminance of a linear sRGB colour.
double Luminance(const Rgb& linear);

// Collects luminance. The order of the calls matters only by rounding.
class ExposureMeter {
 public:
  void Add(const Rgb& radiosity, double weight);

  // The weighted geometric mean of luminance, without values more than a
  // thousand times darker than the arithmetic mean; 1 if nothing is lit.
  [[nodiscard]] double Key() const;

 private:
  static constexpr int kBinsPerOctave = 4;
  static constexpr int kOctaves = 80;  // from 2^-40 to 2^40
  static constexpr size_t kBinCount = size_t{kBinsPerOctave} * kOctaves;

  std::array<double, kBinCount> weights_{};
};

class ToneMap {
 public:
  // `key` is mapped to a middle tone, brighter by `stops`.
  ToneMap(double key, double stops);

  // Linear, in [0, 1].
  [[nodiscard]] Rgb Linear(const Rgb& radiosity) const;

  // sRGB-encoded, 0 to 255.
  [[nodiscard]] std::array<uint8_t, 3> Encoded(const Rgb& radiosity) const;

 private:
  double scale_;
};

// The sRGB transfer function on [0, 1], to 0..255.
uint8_t EncodeSrgb(double linear);

}  // namespace enfilade
