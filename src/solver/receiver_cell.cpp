#include "solver/receiver_cell.h"

#include <algorithm>

namespace enfilade {
namespace {

VisibleSet SourcesOf(SolveContext& context, CellId cell, MemoryCharge* charge) {
  const auto reserve = [&](uint64_t bytes) {
    *charge = context.pager.Items().Reserve(bytes, "what a cell sees");
  };
  if (context.state.phase == SolvePhase::kRefine) {
    return context.ReadOnce(
        [&] { return LoadVisibleSet(context.store, cell, reserve); });
  }
  const std::vector<CellId> seen = context.pager.Pairs().SeenFrom(cell);
  reserve((seen.size() + 1) * sizeof(VisibleCell));
  VisibleSet sources;
  sources.reserve(seen.size() + 1);  // and the cell itself
  for (const CellId source : seen) {
    sources.push_back({source, {}});
  }
  return sources;
}

void PutLast(CellId cell, VisibleSet* sources) {
  const auto self =
      std::find_if(sources->begin(), sources->end(), [&](const VisibleCell& v) {
        return v.source == cell;
      });
  if (self == sources->end()) {
    sources->push_back({cell, {cell}});
  } else {
    std::rotate(self, self + 1, sources->end());
  }
}

}  // namespace

ReceiverCell::ReceiverCell(SolveContext& context, CellId cell)
    : id(cell), sources(SourcesOf(context, cell, &sources_charge)) {
  PutLast(cell, &sources);
  context.pager.StartTurn(cell, sources);
  geometry = context.pager.Geometry(cell);
  tree = context.pager.Tree(cell);
  received = context.pager.Received(cell);
}

GatherSide SourceSide(const CellGeometry& geometry, const CellTree& tree) {
  return {geometry.patches, &tree, &geometry.groups};
}

}  // namespace enfilade
