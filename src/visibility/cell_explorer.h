// What one cell can see: a depth-first walk over sequences of portals, cut off
// where no line stabs the sequence. Internal to src/visibility.

#pragma once

#include "base/ids.h"
#include "partition/partition.h"
#include "visibility/portal_graph.h"

#include <cstdint>
#include <vector>

namespace enfilade {

// A cell that the source may see, and the cells that a ray between the two may
// pass, both ends included, ascending.
struct SeenCell {
  CellId cell;
  std::vector<CellId> between;
};

struct Exploration {
  std::vector<SeenCell> seen;  // ascending; the source itself included
  uint64_t steps = 0;
  bool budget_spent = false;
};

// Tries at most about `max_steps` sequences, shared evenly among the portals
// of the source. Where a portal's share is spent, everything beyond it counts
// as seen that a flood from portal to portal reaches, each of them stabbed by
// a line together with the first alone; and every cell so reached that meets
// the box around source and target lies between them.
Exploration ExploreFrom(CellId source,
                        const Partition& partition,
                        const PortalGraph& graph,
                        uint32_t max_steps);

}  // namespace enfilade
