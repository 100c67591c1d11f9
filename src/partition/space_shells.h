// Finds in which of the Spaces that the input names a point lies.

#pragma once

#include "base/memory.h"
#include "partition/bsp_builder.h"
#include "scene/scene_store.h"

#include <optional>
#include <vector>

namespace enfilade {

// The Space of each leaf: the one whose shell (faces and openings) has the
// greatest winding number around the leaf's center, or nullopt for the outside
// if no winding number exceeds 1/2. A shell with gaps gives the likeliest
// answer.
std::vector<std::optional<SpaceId>> SpacesOfLeaves(const BlockStorage& store,
                                                   const SceneInfo& info,
                                                   const LeafShapes& leaves,
                                                   MemoryBudget& budget);

}  // namespace enfilade
