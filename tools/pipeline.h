// The way from a scene file to a solution, stage by stage:
//
//   import -> partition -> visibility -> trace chunks -> solve
//
// Each stage is committed when it is complete, so that a run that is killed
// goes on at the stage it was in: the stages before the solve start over
// (their half-written blocks are erased), the solve continues from its own
// last commit.

#pragma once

#include "base/block_storage.h"
#include "base/memory.h"

#include "tools/pipeline_limits.h"
#include "tools/pipeline_state.h"
#include "tools/progress.h"

namespace enfilade {

// Carries the store, which must hold settings and a stage, to a solution that
// meets the settings' error, or to the solver's verdict that it cannot be met
// (SolveSummary::converged). Throws InterruptedError when a stop was requested
// and what was done is committed; any other error leaves the last commit.
SolveSummary RunPipeline(BlockStorage& store,
                         const SolveSettings& settings,
                         const RunLimits& limits,
                         MemoryBudget& budget,
                         Progress& progress);

// The stages before the solve only, with which the store can be solved or
// looked at.
void PreparePipeline(BlockStorage& store,
                     const SolveSettings& settings,
                     const RunLimits& limits,
                     MemoryBudget& budget,
                     Progress& progress);

// Throws InputError if the scene's files are no longer those that the store
// was made of. Files that cannot be found are no error once the scene is in
// the store: then returns false.
bool CheckSceneUnchanged(const BlockStorage& store,
                         const SolveSettings& settings);

}  // namespace enfilade
