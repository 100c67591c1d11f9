// Joins leaves of the tree into cells: rooms as the input names them, or what
// lies open to each other and not through a door.

#pragma once

#include "base/ids.h"
#include "partition/leaf_graph.h"
#include "partition/partition.h"
#include "scene/scene_store.h"

#include <cstdint>
#include <optional>
#include <vector>

namespace enfilade {

struct LeafCells {
  std::vector<CellId> cell_of_leaf;  // indexed by LeafId
  uint32_t cell_count = 0;
  // Indexed by CellId: the Space that the cell is a part of.
  std::vector<std::optional<SpaceId>> space;
};

// `space_of_leaf` is empty for a scene without Spaces. No cell that is joined
// of several leaves gets more than options.max_cell_patches patches.
LeafCells JoinLeaves(const BuiltTree& built,
                     const FaceSurvey& survey,
                     const std::vector<LeafBorder>& borders,
                     const std::vector<std::optional<SpaceId>>& space_of_leaf,
                     const PartitionOptions& options);

}  // namespace enfilade
