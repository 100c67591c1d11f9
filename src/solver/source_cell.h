// A cell that sends light, while links from it are made.

#pragma once

#include "base/ids.h"
#include "solver/elements/element_tree.h"
#include "solver/receiver_cell.h"
#include "solver/refine/pair_work.h"
#include "solver/refine/source_weights.h"
#include "solver/solve_context.h"
#include "solver/transfer/cell_geometry.h"
#include "visibility/visible_set.h"

#include <memory>
#include <vector>

namespace enfilade {

struct SourceCell {
  // Pages in what it takes to find the work of a pair; the tree follows if
  // there is any.
  SourceCell(SolveContext& context, CellId cell);

  CellId id;
  std::shared_ptr<const CellGeometry> geometry;
  std::shared_ptr<const SourceWeights> weights;
  std::shared_ptr<CellTree> tree;
};

// The work between a receiver and a source as the receiver sees it.
PairWork WorkBetween(const SolveContext& context,
                     const ReceiverCell& receiver,
                     const SourceCell& source,
                     const VisibleCell& seen);

// The same with the items that a call of the other function has found.
PairWork WorkBetween(const SolveContext& context,
                     const ReceiverCell& receiver,
                     const SourceCell& source,
                     const VisibleCell& seen,
                     std::vector<WorkItem> items);

// The portals of both cells; none if they are the same cell (Blockers::gates).
std::vector<const ShaftBlockers*> GatesBetween(const ReceiverCell& receiver,
                                               const SourceCell& source);

}  // namespace enfilade
