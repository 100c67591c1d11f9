// Clips the faces of the scene to cells, cuts them into patches, and writes
// each cell's block.

#pragma once

#include "base/block_storage.h"
#include "base/memory.h"
#include "partition/bsp_tree.h"
#include "partition/contact.h"
#include "partition/overlap.h"
#include "partition/partition.h"
#include "scene/scene_store.h"

#include <functional>
#include <vector>

namespace enfilade {

// Counts of what was done where surfaces lie in one another or touch.
struct TouchCounts {
  OverlapCounts overlaps;
  ContactCounts contacts;
};

// Streams the store's faces and writes a kCellPatches block per cell. The
// caller fills in the bounds of the cells; WritePatches fills in their patch
// counts and areas. Holds a few MiB of patches at a time, or the patches of one
// cell, and parks the others in kScratch blocks.
TouchCounts WritePatches(const SceneInfo& info,
                         const BspTree& tree,
                         const std::vector<CellId>& cell_of_leaf,
                         MemoryBudget& budget,
                         BlockStorage& store,
                         std::vector<CellInfo>& cells);

}  // namespace enfilade
