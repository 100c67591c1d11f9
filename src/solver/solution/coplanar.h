// Groups of coplanar patches in coordinates of their plane: what the display
// meshes need to know of the surroundings of an element.
//
// Lengths and plane coordinates are in metres.

#pragma once

#include "base/ids.h"
#include "base/vec.h"
#include "partition/patch.h"

#include <cstdint>
#include <span>
#include <vector>

namespace enfilade {

// A point of a plane, in the coordinates of a PatchPlane.
struct PlanePoint {
  double x = 0;
  double y = 0;
};

inline PlanePoint operator-(PlanePoint a, PlanePoint b) {
  return {a.x - b.x, a.y - b.y};
}

// Twice the area of the triangle 0, a, b; positive counter-clockwise.
inline double Cross(PlanePoint a, PlanePoint b) {
  return a.x * b.y - a.y * b.x;
}

double Length(PlanePoint a);

// Orthonormal axes in the plane of a patch, counter-clockwise seen from its
// front.
struct PatchPlane {
  Point3 origin;
  Vec3 x_axis, y_axis, normal;

  // Requires a patch of nonzero area.
  explicit PatchPlane(const Patch& patch);

  [[nodiscard]] PlanePoint ToPlane(Point3 p) const {
    return {Dot(p - origin, x_axis), Dot(p - origin, y_axis)};
  }

  [[nodiscard]] Point3 ToSpace(PlanePoint p) const {
    return origin + x_axis * p.x + y_axis * p.y;
  }

  // Distance from the plane, positive in front.
  [[nodiscard]] double Height(Point3 p) const {
    return Dot(p - origin, normal);
  }
};

// The patches of a cell in groups. The patches of one group share their plane
// (corners within kOnPlaneM), front side, material, emission and reflection.
struct CoplanarPatches {
  // Finds the groups. `cell_patches` are all patches of the cell; they are
  // borrowed.
  explicit CoplanarPatches(std::span<const Patch> cell_patches);

  // The most bytes that the groups take per patch, also while they are made.
  static constexpr uint64_t kPatchBytes = 288;

  [[nodiscard]] const Patch& FirstOf(size_t group) const {
    return patches[groups[group].front().Index()];
  }

  std::span<const Patch> patches;
  std::vector<Box3> boxes;  // indexed by PatchId
  // Groups are in the order of their first patch, the patches of each group in
  // ascending order.
  std::vector<std::vector<PatchId>> groups;
};

struct PlaneSegment {
  PlanePoint a, b;
};

// The segments along which other patches of the cell stand on the plane of a
// group or cut it. Irradiance may be discontinuous there.
std::vector<PlaneSegment> StandingSegments(const CoplanarPatches& cell,
                                           size_t group);

}  // namespace enfilade
