// How often a surface of triangles winds around a point.

#pragma once

#include "base/photometry.h"
#include "base/vec.h"

#include <cmath>
#include <span>

namespace enfilade {

struct Triangle3 {
  Point3 a, b, c;
};

// The solid angle of a triangle seen from the origin, in steradian, by van
// Oosterom and Strackee (1983), eq. 8: positive if the origin is behind the
// triangle.
inline double SolidAngle(Vec3 a, Vec3 b, Vec3 c) {
  const double la = Length(a);
  const double lb = Length(b);
  const double lc = Length(c);
  return 2 * std::atan2(Dot(a, Cross(b, c)),
                        la * lb * lc + Dot(a, b) * lc + Dot(b, c) * la +
                            Dot(c, a) * lb);
}

// 1 inside a closed surface whose triangles face outwards, -1 if they face
// inwards, 0 outside; in between if the surface has gaps.
inline double WindingNumber(std::span<const Triangle3> surface, Point3 p) {
  double solid_angle = 0;
  for (const Triangle3& t : surface) {
    solid_angle += SolidAngle(t.a - p, t.b - p, t.c - p);
  }
  return solid_angle / (4 * kPi);
}

}  // namespace enfilade
