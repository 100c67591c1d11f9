// Cell-to-cell visibility: which cells a cell can see through sequences of
// portals that one line can stab (Teller & Sequin 1991). Conservative: a set
// never leaves out a cell that a ray can reach. The number of steps is bounded:
// if a cell's budget of steps is spent, all that a coarser conservative test
// reaches counts as visible (cell_explorer.h).

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
  // included, ascending. They contain all blockers between the two.
  std::vector<CellId> between;
  // The parts of the receiver and of the source that a ray between them can
  // meet.
  CellPart of_receiver = {};
  CellPart of_source = {};
};

// The visible set of one receiver cell, ascending by source, the receiver
// itself included. Symmetric: if A sees B then B sees A, with the same
// `between` and the same parts.
using VisibleSet = std::vector<VisibleCell>;

// The memory that the set takes.
uint64_t BytesOf(const VisibleSet& set);
// The memory of a set of so many sources with so many cells between in total.
uint64_t VisibleSetBytes(size_t sources, size_t between);

struct VisibilityOptions {
  uint32_t max_steps_per_cell = 2000;  // portal sequences tried per cell
  std::function<void(double fraction)> progress;  // may be empty
};

struct VisibilitySummary {
  uint64_t visible_pairs = 0;  // ordered pairs, a cell with itself included
  uint64_t budget_spent_cells = 0;
};

// Writes a kVisibleSet block per cell and a meta entry. The result is the same
// to the bit for every budget and number of threads. Charges the memory of the
// search to the budget, and goes through the portals a few times. Throws
// DoesNotFitError if the budget does not hold the search of one cell.
VisibilitySummary BuildVisibleSets(std::span<const CellInfo> cells,
                                   const PortalSource& portals,
                                   const VisibilityOptions& options,
                                   MemoryBudget& budget,
                                   BlockStorage& store);

// The same for a partition in memory.
VisibilitySummary BuildVisibleSets(const Partition& partition,
                                   const VisibilityOptions& options,
                                   MemoryBudget& budget,
                                   BlockStorage& store);

VisibilitySummary LoadVisibilitySummary(const BlockStorage& store);

// Loads the cells that a receiver sees, ascending, without what is between.
std::vector<CellId> LoadVisibleSources(const BlockStorage& store,
                                       CellId receiver);
// Loads the visible set of a receiver. Before the set is made, `reserve` is
// told how many bytes it takes: the set of the outdoors of a large building
// takes tens of MB.
VisibleSet LoadVisibleSet(
    const BlockStorage& store,
    CellId receiver,
    const std::function<void(uint64_t bytes)>& reserve = {});

}  // namespace enfilade
