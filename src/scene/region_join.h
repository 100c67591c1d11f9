// A region consists of coplanar polygons of one batch that share edges. They
// are joined to one planar figure with holes and cut into few convex pieces.

#pragma once

#include "base/vec.h"
#include "scene/vertex_loop.h"

#include <cstdint>
#include <span>
#include <vector>

namespace enfilade {

struct RegionTolerance {
  double weld = 1e-5;   // vertices closer than this are the same, m
  double plane = 1e-4;  // vertices this near a plane lie in the plane, m
};

// Groups polygons that are connected through shared edges, lie in one plane and
// have the same number in `kinds`. Every polygon is in exactly one group.
// Unless `oriented`, polygons may be reversed (in place) to agree with the
// first of their group, which is never reversed.
std::vector<std::vector<uint32_t>> FindRegions(
    std::span<const Point3> vertices,
    std::vector<VertexLoop>& polygons,
    std::span<const uint32_t> kinds,
    const RegionTolerance& tolerance,
    bool oriented);

// What CutRegionOf made.
struct RegionPieces {
  std::vector<std::vector<Point3>> pieces;  // convex, facing as the region
  size_t refused = 0;  // polygons that no manifold mesh takes: kept apart
};

// Covers the union of the polygons of one region with convex pieces.
RegionPieces CutRegionOf(std::span<const Point3> vertices,
                         std::span<const VertexLoop> polygons,
                         const RegionTolerance& tolerance);

}  // namespace enfilade
