// Planar figures in space, cut by polygon_cut.h in a frame of their own.

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

// The direction that most of the edges' length follows, or crosses at a right
// angle, in the plane of that normal.
Vec3 DominantDirection(std::span<const Edge3> edges, Vec3 normal);

// CutRegion of the figure inside directed edges (interior on the left, seen
// against the normal): convex pieces that face along the normal. Input
// vertices keep their exact places. At least one edge; normal not zero.
std::vector<Polygon3> CutFigure(std::span<const Edge3> edges,
                                Vec3 normal,
                                double tolerance,
                                int threshold = 1);

// The polygon that the edges run around, if they are one closed convex loop in
// order with at most eight corners.
std::optional<Polygon3> AsConvex(std::span<const Edge3> edges, Vec3 normal);

// Drops each vertex that lies, within the tolerance, on the line between the
// one kept before it and the next.
Polygon3 WithoutStraightCorners(std::span<const Point3> loop, double tolerance);

// The sides of a closed polygon, appended.
void AppendSides(std::span<const Point3> polygon,
                 bool reversed,
                 std::vector<Edge3>& edges);

}  // namespace enfilade
