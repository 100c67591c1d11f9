// Unit vectors: axes about them, and directions to sample.

#pragma once

#include "base/photometry.h"
#include "base/random.h"
#include "base/vec.h"

#include <algorithm>
#include <cmath>

namespace enfilade {

// Right-handed orthonormal axes, the third one a normal.
struct NormalAxes {
  Vec3 u, v, normal;

  // The direction at an angle from the normal with this cosine and sine, turned
  // about the normal by an angle from u in radians.
  [[nodiscard]] Vec3 Direction(double cosine, double sine, double angle) const {
    return normal * cosine + u * (sine * std::cos(angle)) +
           v * (sine * std::sin(angle));
  }

  // A direction with a density proportional to its cosine with the normal, from
  // two numbers in [0, 1).
  [[nodiscard]] Vec3 CosineDirection(double s, double t) const {
    const double radius = std::sqrt(s);
    const double angle = 2 * kPi * t;
    const double height = std::sqrt(std::max(1e-12, 1 - s));
    return u * (radius * std::cos(angle)) + v * (radius * std::sin(angle)) +
           normal * height;
  }
};

// Axes about a unit normal.
inline NormalAxes AxesAbout(Vec3 normal) {
  const Vec3 helper = std::abs(normal.x) < 0.6 ? Vec3{1, 0, 0} : Vec3{0, 1, 0};
  const Vec3 u = Normalize(Cross(helper, normal));
  return {u, Cross(normal, u), normal};
}

// Axes about a unit normal, the first one along a vector at a right angle to
// it.
inline NormalAxes AxesAbout(Vec3 normal, Vec3 along) {
  const Vec3 u = Normalize(along);
  return {u, Cross(normal, u), normal};
}

// Uniform over the unit sphere.
inline Vec3 RandomDirection(Random& random) {
  const double z = 2 * random.Next() - 1;
  const double phi = 2 * kPi * random.Next();
  const double r = std::sqrt(1 - z * z);
  return {r * std::cos(phi), r * std::sin(phi), z};
}

}  // namespace enfilade
