// Which plane splits a region best: along large opaque surfaces, never along
// furniture.

#pragma once

#include "partition/convex_region.h"
#include "partition/wall_faces.h"

#include <cstdint>
#include <optional>
#include <vector>

namespace enfilade {

// The part of a wall face inside a region.
struct WallFragment {
  uint32_t face = 0;  // index into WallFaces::faces
  Polygon polygon;
};

// The plane of some of the fragments, or nullopt when none is a wall of the
// region. A wall is a plane whose fragments cover a good part of the region's
// cross-section, or stand from floor to ceiling, or are a large slab (the exact
// shares are constants of the source, docs/decisions/partition-bsp.md). Where
// WallFaces::all_split, every fragment is a wall. Prefers planes that cover
// much of the cross-section, balance the fragments and cut few.
std::optional<Plane> ChooseSplit(const ConvexRegion& region,
                                 const std::vector<WallFragment>& fragments,
                                 const WallFaces& walls);

}  // namespace enfilade
