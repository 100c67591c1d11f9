// Cuts a planar region, which may have holes, into few convex pieces that cover
// it exactly and do not overlap.
//
// A region is given by its directed boundary edges, interior on the left, in
// any order. Loops need not be linked, and edges may touch, coincide and cross:
// a point is inside if its winding number is at least `threshold`. A sweep
// along each axis of the frame makes trapezoids (de Berg et al., Computational
// Geometry, chapter 6, without the search structure) and merges stacked
// trapezoids with the same legs; the cheaper of the two results is kept.
// Rectilinear regions come out as rectangles.

#pragma once

#include "base/vec.h"

#include <cstddef>
#include <span>
#include <vector>

namespace enfilade {

struct Point2 {
  double x = 0, y = 0;

  friend bool operator==(const Point2&, const Point2&) = default;
};

struct Edge2 {
  Point2 from, to;
};

using Polygon2 = std::vector<Point2>;

// A plane with two orthonormal axes in it. Axes along world axes are exact, so
// that To3(To2(p)) leaves points of an axis-parallel plane unchanged.
struct PlaneFrame {
  Point3 origin;
  Vec3 u, v, normal;

  [[nodiscard]] Point2 To2(Point3 p) const {
    return {Dot(p - origin, u), Dot(p - origin, v)};
  }

  [[nodiscard]] Point3 To3(Point2 p) const {
    return origin + u * p.x + v * p.y;
  }
};

// The frame of the plane through `point` with that normal, of any nonzero
// length. The first axis is `direction` projected into the plane.
PlaneFrame MakePlaneFrame(Point3 point, Vec3 normal, Vec3 direction);

// The convex pieces of the region, counter-clockwise. Coordinates closer than
// `tolerance` count as equal; pieces thinner than `tolerance` are dropped.
std::vector<Polygon2> CutRegion(std::span<const Edge2> edges,
                                double tolerance,
                                int threshold = 1);

// Signed area, positive counter-clockwise.
double SignedArea(std::span<const Point2> polygon);

// The number of patches that the piece makes: 1 for a triangle or a
// parallelogram, n - 2 for any other convex polygon of n vertices.
size_t PatchCost(std::span<const Point2> piece, double tolerance);

// Whether the polygon is counter-clockwise, convex, and not self-overlapping.
bool IsConvex(std::span<const Point2> polygon, double tolerance);

// Appends the edges of a closed polygon, in the plane or in space.
template <typename Points, typename Edge>
void AppendEdges(const Points& polygon,
                 bool reversed,
                 std::vector<Edge>& edges) {
  for (size_t i = 0; i < polygon.size(); ++i) {
    const auto a = polygon[i];
    const auto b = polygon[(i + 1) % polygon.size()];
    edges.push_back(reversed ? Edge{b, a} : Edge{a, b});
  }
}

}  // namespace enfilade
