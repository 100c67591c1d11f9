// Chooses the plane that splits a region best: along large opaque surfaces,
// never along furniture.

#pragma once

#include "partition/convex_region.h"
#include "partition/walls.h"

#include <cstdint>
#include <optional>

namespace enfilade {

// Returns the plane of some of the fragments, or nullopt if none of their
// planes is a wall of the region. A plane is a wall if its fragments cover a
// good part of the region's cross-section, or stand from floor to ceiling, or
// are a large slab (the exact shares are constants of the source,
// docs/decisions/partition-bsp.md). With WallRules::all_split, every plane is a
// wall. Prefers planes that cover much of the cross-section, balance the
// fragments and cut few of them. Reads the list several times; the memory of
// the choice itself grows with the number of planes and with the largest slab.
// Throws DoesNotFitError.
std::optional<Plane> ChooseSplit(const ConvexRegion& region,
                                 const FragmentList& fragments,
                                 const WallRules& rules,
                                 MemoryBudget& budget);

}  // namespace enfilade
