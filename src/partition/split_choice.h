// Which plane splits a region best: along large opaque surfaces, never along
// furniture.

#pragma once

#include "partition/convex_region.h"
#include "partition/walls.h"

#include <cstdint>
#include <optional>

namespace enfilade {

// The plane of some of the fragments, or nullopt when none is a wall of the
// region. A wall is a plane whose fragments cover a good part of the region's
// cross-section, or stand from floor to ceiling, or are a large slab (the exact
// shares are constants of the source, docs/decisions/partition-bsp.md). Where
// WallRules::all_split, every fragment is a wall. Prefers planes that cover
// much of the cross-section, balance the fragments and cut few. Reads the list
// several times; what it takes itself grows with the planes, and with the
// largest slab. Throws DoesNotFitError.
std::optional<Plane> ChooseSplit(const ConvexRegion& region,
                                 const FragmentList& fragments,
                                 const WallRules& rules,
                                 MemoryBudget& budget);

}  // namespace enfilade
