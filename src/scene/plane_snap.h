// Few planes for many polygons: polygons that lie in one plane up to the
// rounding of their file are given exactly one, and planes that are nearly
// parallel or square to others are made so.

#pragma once

#include "base/vec.h"

#include <cstdint>
#include <span>
#include <vector>

namespace enfilade {

// { x : normal . x = offset }, the normal of length 1.
struct ScenePlane {
  Vec3 normal;
  double offset = 0;

  [[nodiscard]] double Distance(Point3 p) const {
    return Dot(normal, p - Point3{}) - offset;
  }
};

struct SnappedPlanes {
  std::vector<ScenePlane> planes;  // those of large polygons first
  std::vector<uint32_t> plane_of;  // by polygon: index into planes
};

// Each polygon (at least three vertices, of some area, roughly planar) gets a
// plane that no vertex of it is farther from than the tolerance, the plane of
// a larger polygon where one is that near; its own otherwise, turned to an
// axis, upright, or parallel or square to a larger polygon where that moves no
// vertex by more than half the tolerance. A polygon that is not planar within
// the tolerance gets its own plane regardless.
SnappedPlanes SnapPlanes(std::span<const std::vector<Point3>> polygons,
                         double tolerance);

}  // namespace enfilade
