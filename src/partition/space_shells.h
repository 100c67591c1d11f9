// In which of the Spaces that the input names a point lies.

#pragma once

#include "base/memory.h"
#include "partition/bsp_builder.h"
#include "scene/scene_store.h"

#include <optional>
#include <vector>

namespace enfilade {

// The Space of each leaf by the winding number of the Spaces' shells (faces
// and openings) around the leaf's center: the greatest above 1/2, nullopt for
// the outside. A shell with gaps gives the likeliest answer.
std::vector<std::optional<SpaceId>> SpacesOfLeaves(const BlockStorage& store,
                                                   const SceneInfo& info,
                                                   const LeafShapes& leaves,
                                                   MemoryBudget& budget);

}  // namespace enfilade
