// Finds what one cell can see by a depth-first walk over sequences of portals.
// The walk is cut off where no line stabs the sequence. Internal to
// src/visibility.

#pragma once

#include "base/ids.h"
#include "base/memory.h"
#include "partition/partition.h"
#include "visibility/beam_flood.h"
#include "visibility/cell_part.h"
#include "visibility/portal_graph.h"

#include <cstdint>
#include <vector>

namespace enfilade {

// A cell that the source may see, and the cells that a ray between the two may
// pass, both ends included, ascending. For a loose cell, `between` is empty and
// the cells between are unknown.
struct SeenCell {
  CellId cell;
  bool is_loose = false;
  std::vector<CellId> between = {};
  CellPart part = {};  // part of `cell` that the source may see
  // The part of the source that `cell` may see, set once both ends agree.
  CellPart of_source = {};
};

struct Exploration {
  std::vector<SeenCell> seen;  // ascending; the source itself included
  MemoryCharge charge;         // of `seen`
  uint64_t steps = 0;
  bool budget_spent = false;
};

// Tries at most about `max_steps` sequences, shared evenly among the portals of
// the source. In addition, a flood through the openings of regions
// (beam_flood.h) takes into account the walls within cells, but not the
// sequences of portals. Cells that the flood does not reach are struck out. If
// the share of some portal is spent, all cells that the flood reaches are seen
// loosely. The result is charged to the budget; the memory of the search is not
// (BeamFlood::MostBytes, BytesToNoteSeen).
Exploration ExploreFrom(CellId source,
                        std::span<const CellInfo> cells,
                        const PortalGraph& graph,
                        const RegionGraph& regions,
                        uint32_t max_steps,
                        MemoryBudget& budget);

// The memory that it takes to note which of so many cells are seen.
uint64_t BytesToNoteSeen(size_t cells, uint32_t max_steps);

}  // namespace enfilade
