// Cuts leaves that hold too many patches by walls that are all portal, so that
// the data of one cell stays under a fixed size.

#pragma once

#include "base/block_storage.h"
#include "base/memory.h"
#include "partition/bsp_builder.h"
#include "partition/face_survey.h"

#include <cstdint>

namespace enfilade {

// Cuts every leaf that has more than `most_patches` patches at the median of
// its faces' centers, perpendicular to its longest axis, and cuts the parts
// again while they have more. Gives up on leaves that cutting does not relieve.
// Returns the survey of the final tree.
FaceSurvey RelieveCrowdedLeaves(const BlockStorage& store,
                                uint32_t most_patches,
                                MemoryBudget& budget,
                                BuiltTree& built);

}  // namespace enfilade
