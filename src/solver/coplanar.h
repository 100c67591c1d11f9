// Patches that lie in one plane, seen in that plane: what the meshes for
// display need to know of the surroundings of an element.
//
// Lengths are in metres, plane coordinates too.

#pragma once

#include "base/ids.h"
#include "base/vec.h"
#include "partition/patch.h"

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace enfilade {

// A point of a plane, in the coordinates of a PlaneFrame.
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
struct PlaneFrame {
  Point3 origin;
  Vec3 x_axis, y_axis, normal;

  // Requires a patch of nonzero area.
  explicit PlaneFrame(const Patch& patch);

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

// The patches of a cell in groups of equal plane and side (to kOnPlaneM over
// their size), material, emission and reflection. Groups are in the order of
// their first patch, and patches in theirs.
std::vector<std::vector<PatchId>> CoplanarGroups(
    std::span<const Patch> patches);

struct PlaneSegment {
  PlanePoint a, b;
};

// Where other patches of the cell stand on the plane of `group` or cut it:
// there light may change at once. `patches` are all of the cell.
std::vector<PlaneSegment> StandingSegments(std::span<const Patch> patches,
                                           std::span<const PatchId> group);

// Finds things by the boxes around them, in the plane.
class PlaneIndex {
 public:
  struct Box {
    PlanePoint low{1e300, 1e300};
    PlanePoint high{-1e300, -1e300};

    void Include(PlanePoint p);
  };

  // Boxes are indexed in their order; `margin_m` is added around each.
  PlaneIndex(std::span<const Box> boxes, double margin_m);

  // Indices in rising order; a superset of the boxes that contain `p`. Valid as
  // long as the index.
  [[nodiscard]] std::span<const uint32_t> Near(PlanePoint p) const;

  [[nodiscard]] uint64_t SizeBytes() const {
    return 4 * (starts_.capacity() + items_.capacity());
  }

 private:
  [[nodiscard]] std::array<size_t, 2> SlotOf(PlanePoint p) const;

  Box bounds_;
  size_t columns_ = 1;
  size_t rows_ = 1;
  std::vector<uint32_t> starts_;  // [row * columns + column], and the end
  std::vector<uint32_t> items_;
};

}  // namespace enfilade
