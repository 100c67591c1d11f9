// Cell-to-cell visibility: which cells a cell can see through sequences of
// portals that one line can stab (Teller & Sequin 1991). Conservative: never
// leaves out a cell that a ray can reach. Bounded in steps: where a cell's
// budget of steps is spent, what a coarser conservative test reaches counts as
// visible (cell_explorer.h).

#pragma once

#include "base/block_storage.h"
#include "base/ids.h"
#include "base/memory.h"
#include "partition/partition.h"
#include "partition/partition_store.h"
#include "visibility/cell_part.h"

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace enfilade {

// A cell that the receiver cell can see.
struct VisibleCell {
  CellId source;
  // The cells that a ray between receiver and source can pass, both ends
  // included, ascending: where its blockers are.
  std::vector<CellId> between;
  // What a ray between receiver and source can meet of each.
  CellPart of_receiver = {};
  CellPart of_source = {};
};

// Of one receiver cell: ascending by source, itself included. Symmetric: if A
// sees B then B sees A, with the same `between` and the same parts.
using VisibleSet = std::vector<VisibleCell>;

// What it takes in memory.
uint64_t BytesOf(const VisibleSet& set);
// Of so many sources with so many cells in between, all of them together.
uint64_t VisibleSetBytes(size_t sources, size_t between);

struct VisibilityOptions {
  uint32_t max_steps_per_cell = 2000;  // portal sequences tried per cell
  std::function<void(double fraction)> progress;  // may be empty
};

struct VisibilitySummary {
  uint64_t visible_pairs = 0;  // ordered pairs, a cell with itself included
  uint64_t budget_spent_cells = 0;
};

// Writes a kVisibleSet block per cell and a meta entry: the same bits whatever
// the budget, to which looking through doorways is charged, and the threads.
// Goes through the portals a few times. DoesNotFitError when the budget does
// not hold it for one cell.
VisibilitySummary BuildVisibleSets(std::span<const CellInfo> cells,
                                   const PortalSource& portals,
                                   const VisibilityOptions& options,
                                   MemoryBudget& budget,
                                   BlockStorage& store);

// Of a partition in memory.
VisibilitySummary BuildVisibleSets(const Partition& partition,
                                   const VisibilityOptions& options,
                                   MemoryBudget& budget,
                                   BlockStorage& store);

VisibilitySummary LoadVisibilitySummary(const BlockStorage& store);
// Before it is made, `reserve` is told what it will take: that of the outdoors
// of a large building is tens of MB.
VisibleSet LoadVisibleSet(
    const BlockStorage& store,
    CellId receiver,
    const std::function<void(uint64_t bytes)>& reserve = {});

}  // namespace enfilade
