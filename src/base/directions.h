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

// The kernel of light between two surfaces, cos_x cos_y / (pi r^2) in 1/m2, of
// points with unit normals; 0 if one of the points is behind the other.
inline double GeometryTerm(Point3 x, Vec3 normal_x, Point3 y, Vec3 normal_y) {
  const Vec3 d = y - x;
  const double r2 = Dot(d, d);
  const double cos_x = Dot(normal_x, d);
  const double cos_y = -Dot(normal_y, d);
  const bool face = cos_x > 0 && cos_y > 0 && r2 > 0;
  return face ? cos_x * cos_y / (kPi * r2 * r2) : 0;
}

}  // namespace enfilade
