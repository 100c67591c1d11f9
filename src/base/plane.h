// Planes in space.
//
// Notation: a plane is { x : n . x = offset }, |n| = 1; its front is where
// n . x > offset. Lengths are in metres.

#pragma once

#include "base/packed.h"
#include "base/vec.h"

namespace enfilade {

struct Plane {
  Vec3 normal;
  double offset = 0;

  // Positive in front of the plane.
  [[nodiscard]] double Distance(Point3 p) const {
    return Dot(normal, p - Point3{}) - offset;
  }

  [[nodiscard]] Plane Flipped() const { return {-normal, -offset}; }
};

template <>
inline constexpr bool kIsPacked<Plane> = kIsPacked<Vec3> &&
                                         sizeof(Plane) ==
                                             sizeof(Vec3) + sizeof(double);

// A unit vector that ends within the tolerance of a coordinate axis, in either
// direction, becomes exactly that axis.
inline Vec3 SnappedToAxis(Vec3 unit, double tolerance) {
  for (const Vec3 axis : {Vec3{1, 0, 0}, Vec3{0, 1, 0}, Vec3{0, 0, 1}}) {
    const double along = Dot(unit, axis);
    if (Length(unit - axis * along) < tolerance) {
      return along > 0 ? axis : -axis;
    }
  }
  return unit;
}

}  // namespace enfilade
