// Few planes for many polygons. Polygons that lie in one plane up to the
// rounding of their file get exactly one plane, and planes that are nearly
// parallel or perpendicular to others are made exactly so.

#pragma once

#include "base/plane.h"
#include "base/vec.h"

#include <cstdint>
#include <span>
#include <vector>

namespace enfilade {

struct SnappedPlanes {
  std::vector<Plane> planes;       // those of large polygons first
  std::vector<uint32_t> plane_of;  // by polygon: index into planes
};

// Gives each polygon (at least three vertices, nonzero area, roughly planar) a
// plane. If all vertices are within the tolerance of a larger polygon's plane,
// the polygon gets that plane. Otherwise it gets its own, which is turned to an
// axis, upright, or parallel or perpendicular to a larger polygon if that moves
// no vertex by more than half the tolerance. A polygon that is not planar
// within the tolerance gets its own plane too.
SnappedPlanes SnapPlanes(std::span<const std::vector<Point3>> polygons,
                         double tolerance);

}  // namespace enfilade
