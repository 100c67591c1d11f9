// What one cell can see: a depth-first walk over sequences of portals, cut off
// where no line stabs the sequence. Internal to src/visibility.

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
// pass, both ends included, ascending. Of a loose one it is not known what lies
// between: nothing is listed.
struct SeenCell {
  CellId cell;
  bool is_loose = false;
  std::vector<CellId> between = {};
  CellPart part = {};       // of the cell, that the source may see
  CellPart of_source = {};  // that the cell may see, once both ends agree
};

struct Exploration {
  std::vector<SeenCell> seen;  // ascending; the source itself included
  MemoryCharge charge;         // of these
  uint64_t steps = 0;
  bool budget_spent = false;
};

// Tries at most about `max_steps` sequences, shared evenly among the portals
// of the source. Beside that a flood through the openings of regions
// (beam_flood.h) knows nothing of sequences, but of the walls within cells: it
// strikes out what it does not reach, and where portals' shares are spent,
// what it reaches is seen loosely. What is found is charged to the budget; what
// it takes to find it is not (BeamFlood::MostBytes, BytesToNoteSeen).
Exploration ExploreFrom(CellId source,
                        std::span<const CellInfo> cells,
                        const PortalGraph& graph,
                        const RegionGraph& regions,
                        uint32_t max_steps,
                        MemoryBudget& budget);

// What it takes to note which of so many cells are seen.
uint64_t BytesToNoteSeen(size_t cells, uint32_t max_steps);

}  // namespace enfilade
