// Few planes for many polygons. Polygons that lie in one plane up to the
// rounding of their file get exactly one plane, and planes that are nearly
// parallel or perpendicular to others are made exactly so.

#pragma once

#include "base/plane.h"
#include "base/vec.h"

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace enfilade {

struct SnappedPlanes {
  std::vector<Plane> planes;       // those of large polygons first
  std::vector<uint32_t> plane_of;  // by polygon: index into planes
};

// How far vertices may be from a plane with this unit normal, m.
struct PlaneTolerance {
  std::function<double(Vec3 normal)> of_known;
  std::function<double(Vec3 normal)> of_turned;
};

// Gives each polygon (at least three vertices, nonzero area, roughly planar) a
// plane. If all vertices are within the tolerance of a larger polygon's plane,
// the polygon gets that plane. Otherwise it gets its own, which is turned to an
// axis, along an axis, or parallel or perpendicular to a larger polygon if that
// moves no vertex by more than the tolerance of turned planes. A polygon that
// is not planar within the tolerance gets its own plane too.
// `directions`: unit vectors to which planes are turned before all others but
// the axes.
SnappedPlanes SnapPlanes(std::span<const std::vector<Point3>> polygons,
                         const PlaneTolerance& tolerance,
                         std::span<const Vec3> directions = {});

// The same with one tolerance for all planes, and half of it for turned ones.
SnappedPlanes SnapPlanes(std::span<const std::vector<Point3>> polygons,
                         double tolerance_m);

}  // namespace enfilade
