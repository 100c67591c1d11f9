// Joins leaves of the tree into cells. A cell is a room as the input names it,
// or a set of leaves that are open to each other without a door between them.

#pragma once

#include "base/ids.h"
#include "partition/face_survey.h"
#include "partition/open_borders.h"
#include "partition/partition.h"
#include "scene/scene_store.h"

#include <cstdint>
#include <optional>
#include <vector>

namespace enfilade {

struct LeafCells {
  std::vector<CellId> cell_of_leaf;  // indexed by LeafId
  uint32_t cell_count = 0;
  // Indexed by CellId: the Space that contains the cell.
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

// The most memory that joining takes.
uint64_t BytesToJoin(size_t leaves, size_t borders);

// In a scene with Spaces, a cell consists of the leaves of one Space that are
// open to each other. In a scene without Spaces, these leaves are joined:
// leaves that look like one room, the outdoors, and a set that is too small for
// a room with the neighbour that it opens to. No cell that is joined of several
// leaves gets more than options.max_cell_patches patches.
LeafCells JoinLeaves(const JoinInput& input, const PartitionOptions& options);

}  // namespace enfilade
