// A cell that receives light, while it has its turn.

#pragma once

#include "base/ids.h"
#include "base/memory.h"
#include "solver/elements/cell_care.h"
#include "solver/elements/element_tree.h"
#include "solver/elements/received_light.h"
#include "solver/links/gather.h"
#include "solver/solve_context.h"
#include "solver/transfer/cell_geometry.h"
#include "solver/transfer/cluster_tree.h"
#include "visibility/visible_set.h"

#include <memory>
#include <vector>

namespace enfilade {

struct ReceiverCell {
  // Begins the turn in the pager and pages the cell in. In propagation, what
  // lies between the cell and its sources is not known.
  ReceiverCell(SolveContext& context, CellId cell);

  CellId id;
  MemoryCharge sources_charge;
  VisibleSet sources;  // the cell itself comes last
  std::shared_ptr<const CellGeometry> geometry;
  std::shared_ptr<CellTree> tree;
  std::shared_ptr<ReceivedLight> received;

  // During refinement: what is asked of each patch, and the elements at which
  // refinement begins, with their weights (WeighReceiver).
  MemoryCharge care_charge;
  CellCare care;
  MemoryCharge receivers_charge;
  std::unique_ptr<ClusterTree> receivers;
  std::vector<float> weights;
};

// The side of a gather that a cell's elements send from.
GatherSide SourceSide(const CellGeometry& geometry, const CellTree& tree);

}  // namespace enfilade
