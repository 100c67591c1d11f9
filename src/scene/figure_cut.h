// Cuts planar figures in space: polygon_cut.h applied in the figure's plane.

#pragma once

#include "base/vec.h"
#include "scene/polygon_cut.h"

#include <optional>
#include <span>
#include <vector>

namespace enfilade {

struct Edge3 {
  Point3 from, to;
};

using Polygon3 = std::vector<Point3>;

// The direction to which most of the edges' length is parallel or at a right
// angle, in the plane with the given normal.
Vec3 DominantDirection(std::span<const Edge3> edges, Vec3 normal);

// Applies CutRegion to the figure inside directed edges, with the interior on
// the left as seen against the normal. Returns convex pieces that face along
// the normal; input vertices keep their exact places. Requires at least one
// edge and a nonzero normal.
std::vector<Polygon3> CutFigure(std::span<const Edge3> edges,
                                Vec3 normal,
                                double tolerance,
                                int threshold = 1);

// The polygon that the edges run around, if they are one closed convex loop in
// order with at most eight corners.
std::optional<Polygon3> AsConvex(std::span<const Edge3> edges, Vec3 normal);

// Drops each vertex that lies, within the tolerance, on the segment between the
// last vertex kept and the next vertex.
Polygon3 Straightened(std::span<const Point3> loop, double tolerance);

}  // namespace enfilade
