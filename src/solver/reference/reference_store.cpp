#include "solver/reference/reference_store.h"

#include "solver/elements/push_pull.h"
#include "solver/elements/received_light.h"

#include <algorithm>

namespace enfilade {

double TakeCellRows(const ReferenceScene& scene,
                    const std::vector<CellTree>& trees,
                    SolveState* state) {
  state->cells.assign(scene.CellCount(), {});
  double area = 0;
  double reflected = 0;
  for (size_t c = 0; c < trees.size(); ++c) {
    CellRow& row = state->cells[c];
    const auto patches = scene.PatchesOf(c);
    for (const PatchGeometry& p : patches) {
      row.area += p.reflects ? static_cast<double>(p.area) : 0;
    }
    row.reflected = SumOverLeaves(trees[c], patches, trees[c].Sent()).value -
                    EmittedFlux(patches, scene.Surfaces());
    row.peak = trees[c].Sent().MaxAbs();
    area += row.area;
    reflected += row.reflected;
  }
  state->mean_reflected = std::max(reflected / std::max(area, 1e-30), 1e-30);
  return area;
}

void WriteSolution(const std::vector<CellTree>& trees,
                   const std::vector<CoefficientArray>& gathered,
                   const SolveState& state,
                   BlockStorage& store) {
  store.EraseAll(BlockKind::kCellTree);
  store.EraseAll(BlockKind::kReceived);
  store.EraseAll(BlockKind::kLinks);
  for (size_t c = 0; c < trees.size(); ++c) {
    trees[c].Save(store, CellId(c));
    ReceivedLight::SaveGathered(store, CellId(c), gathered[c]);
  }
  SaveSolveState(state, store);
  store.Commit();
}

}  // namespace enfilade
