// Regions: coplanar polygons of one batch that share edges, as one planar
// figure with holes, cut into few convex pieces.

#pragma once

#include "base/vec.h"

#include <cstdint>
#include <span>
#include <vector>

namespace enfilade {

using VertexLoop = std::vector<uint32_t>;  // a polygon by vertex numbers

struct RegionTolerance {
  double weld = 1e-5;   // metres between vertices that are the same
  double plane = 1e-4;  // metres off the plane that still count as in it
};

// Groups the polygons of the same kind (a number for each) that are joined
// through shared edges and lie in one plane; every polygon is in exactly one
// group. Unless `oriented`, polygons may be turned round (in place) to agree
// with the first of their group, which is not.
std::vector<std::vector<uint32_t>> FindRegions(
    std::span<const Point3> vertices,
    std::vector<VertexLoop>& polygons,
    std::span<const uint32_t> kinds,
    const RegionTolerance& tolerance,
    bool oriented);

// What CutRegionOf made.
struct RegionPieces {
  std::vector<std::vector<Point3>> pieces;  // convex, of the region's side
  size_t refused = 0;  // polygons that a manifold could not take: kept apart
};

// Covers the union of the polygons of one region.
RegionPieces CutRegionOf(std::span<const Point3> vertices,
                         std::span<const VertexLoop> polygons,
                         const RegionTolerance& tolerance);

}  // namespace enfilade
