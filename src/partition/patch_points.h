// The corners of patches and points on them. A PatchLike is a Patch, or
// anything else that has its origin, u, v and shape.

#pragma once

#include "base/vec.h"
#include "partition/patch.h"

#include <array>
#include <cstddef>
#include <span>
#include <utility>

namespace enfilade {

// Three or four corners, counter-clockwise seen from the front.
template <typename Point>
struct CornerList {
  std::array<Point, 4> points;
  size_t count = 0;

  [[nodiscard]] std::span<const Point> View() const& {
    return std::span(points).first(count);
  }

  // A view of a temporary would dangle.
  void View() const&& = delete;
};

template <typename PatchLike>
CornerList<Point3> CornersOf(const PatchLike& p) {
  if (p.shape == PatchShape::kTriangle) {
    return {{p.origin, p.origin + p.u, p.origin + p.v, {}}, 3};
  }
  return {{p.origin, p.origin + p.u, p.origin + p.u + p.v, p.origin + p.v}, 4};
}

// The point with patch coordinates (a, b).
template <typename PatchLike>
Point3 PointOn(const PatchLike& p, double a, double b) {
  return p.origin + p.u * a + p.v * b;
}

// Both patch coordinates of the centroid of a patch of this shape.
constexpr double CentroidCoordinate(PatchShape shape) {
  return shape == PatchShape::kTriangle ? 1.0 / 3 : 0.5;
}

template <typename PatchLike>
Point3 Centroid(const PatchLike& p) {
  return p.origin + (p.u + p.v) * CentroidCoordinate(p.shape);
}

// The patch coordinates of a point uniform over a patch of this shape, from two
// numbers uniform in [0, 1): on a triangle, the half of the unit square beyond
// its long side is folded back.
template <typename Number>
std::pair<Number, Number> FoldedOnto(PatchShape shape, Number s, Number t) {
  const bool fold = shape == PatchShape::kTriangle && s + t > 1;
  return fold ? std::pair(1 - s, 1 - t) : std::pair(s, t);
}

}  // namespace enfilade
