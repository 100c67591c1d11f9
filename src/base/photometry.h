// Radiometric quantities and their units, in one place.
//
//   exitance    emitted flux per area          W/m2 (lm/m2 if photometric)
//   radiosity   leaving flux per area          W/m2 (lm/m2)
//   irradiance  arriving flux per area         W/m2 (lux)
//   reflectance diffuse albedo                 1, in [0, 1)

#pragma once

#include <algorithm>
#include <array>
#include <cstddef>

namespace enfilade {

// The channels of scene input. The solver has its own number of channels, known
// at run time, because light groups multiply it.
inline constexpr size_t kRgbChannels = 3;

// One value per colour channel, of any of the quantities above.
using Rgb = std::array<double, kRgbChannels>;

inline double MaxChannel(const Rgb& c) {
  return std::max({c[0], c[1], c[2]});
}

// Where a basis of higher order swings below 0, 0 is nearer to the truth.
inline Rgb NotBelowZero(Rgb value) {
  for (double& channel : value) {
    channel = std::max(channel, 0.0);
  }
  return value;
}

inline double MeanChannel(const Rgb& c) {
  return (c[0] + c[1] + c[2]) / 3;
}

inline constexpr double kPi = 3.14159265358979323846;

}  // namespace enfilade
