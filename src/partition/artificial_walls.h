// Cuts leaves that hold too much by walls that are all portal, so that a
// cell's own data stays under a fixed size.

#pragma once

#include "base/block_storage.h"
#include "base/memory.h"
#include "partition/bsp_builder.h"
#include "partition/leaf_graph.h"

#include <cstdint>

namespace enfilade {

// While a leaf has more than `most_patches`, cuts it square to its longest
// axis at the median of its faces' centers. Gives up on leaves that cutting
// does not relieve. Returns the survey of the final tree.
FaceSurvey RelieveCrowdedLeaves(const BlockStorage& store,
                                uint32_t most_patches,
                                MemoryBudget& budget,
                                BuiltTree& built);

}  // namespace enfilade
