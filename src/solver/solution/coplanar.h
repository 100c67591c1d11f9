// Patches that lie in one plane, seen in that plane: what the meshes for
// display need to know of the surroundings of an element.
//
// Lengths are in metres, plane coordinates too.

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

// The corners of a patch, counter-clockwise seen from its front: 3 or 4.
std::vector<Point3> CornersOf(const Patch& patch);

// The patches of a cell in groups of equal plane and side (corners within
// kOnPlaneM), material, emission and reflection.
struct CoplanarPatches {
  // Finds the groups. `cell_patches` are all of the cell and borrowed.
  explicit CoplanarPatches(std::span<const Patch> cell_patches);

  // What it takes of a patch, at most and while it is made.
  static constexpr uint64_t kPatchBytes = 288;

  [[nodiscard]] const Patch& FirstOf(size_t group) const {
    return patches[groups[group].front().Index()];
  }

  std::span<const Patch> patches;
  std::vector<Box3> boxes;  // indexed by PatchId
  // In the order of their first patch; each in rising order.
  std::vector<std::vector<PatchId>> groups;
};

struct PlaneSegment {
  PlanePoint a, b;
};

// Where other patches of the cell stand on the plane of a group or cut it:
// there light may change at once.
std::vector<PlaneSegment> StandingSegments(const CoplanarPatches& cell,
                                           size_t group);

}  // namespace enfilade
