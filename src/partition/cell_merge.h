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

struct JoinInput {
  const BuiltTree& built;
  const FaceSurvey& survey;
  const LeafBorders& borders;
  // Indexed by LeafId; empty for a scene without Spaces.
  const std::vector<std::optional<SpaceId>>& space_of_leaf;
  bool all_split = false;  // see WallRules
};

// What joining takes in memory, at most.
uint64_t BytesToJoin(size_t leaves, size_t borders);

// With Spaces, the leaves of a Space that are open to each other are a cell.
// Without, leaves are joined that look like one room; the outdoors; and what
// is too small for a room with what it opens to. No cell that is joined of
// several leaves gets more than options.max_cell_patches patches.
LeafCells JoinLeaves(const JoinInput& input, const PartitionOptions& options);

}  // namespace enfilade
