#include "solver/reference/hierarchical_solve.h"

#include "base/stopwatch.h"
#include "solver/reference/hierarchical_method.h"
#include "solver/reference/hierarchical_options.h"
#include "solver/reference/panel_solution.h"
#include "solver/reference/reference_scene.h"
#include "solver/reference/reference_store.h"
#include "solver/state/solve_state.h"

#include <string>

namespace enfilade {

void SolveHierarchically(BlockStorage& store,
                         const SolveOptions& options,
                         MemoryBudget& budget) {
  SolveState state;
  if (LoadSolveState(store, &state) && state.phase == SolvePhase::kDone) {
    return;
  }
  RunControl control;
  control.stop = options.stop;
  control.progress = options.progress;
  const HierarchicalOptions chosen =
      HierarchicalOptionsOf(options.method, options.basis);
  const ReferenceScene scene(store, options.seed, budget);
  const Basis basis(BasisNamed(options.basis));
  const uint64_t rays = TracedRays();
  HierarchicalSolution solution;
  {
    const Stopwatch watch(&state.times.refine_seconds);
    solution = SolveByHierarchy(scene, basis, chosen, control, budget);
  }
  TakeCellRows(scene, solution.trees, &state);
  for (size_t c = 0; c < solution.trees.size(); ++c) {
    state.cells[c].elements = static_cast<uint32_t>(solution.trees[c].Size());
  }
  if (!state.cells.empty()) {
    state.cells[0].links = solution.links;
  }
  state.basis = options.basis;
  state.seed = options.seed;
  state.error = options.error;
  state.residual = solution.residual;
  state.sweeps = solution.passes;
  state.rays = TracedRays() - rays;
  state.converged = solution.complete;
  state.phase = SolvePhase::kDone;
  RoundRecord record;
  record.links = solution.links;
  record.estimated_error = 1;
  state.rounds.push_back(record);
  WriteSolution(solution.trees, solution.gathered, state, store);
}

}  // namespace enfilade
