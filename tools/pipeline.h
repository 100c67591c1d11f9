// The way from a scene file to a solution, stage by stage:
//
//   import -> partition -> visibility -> trace chunks -> solve
//
// Each stage is committed when it is complete, so that a killed run can be
// resumed at the stage it was in. A stage before the solve then starts over, as
// it commits nothing by itself: what it had written goes with its transaction.
// The solve continues from its own last commit.

#pragma once

#include "base/block_storage.h"
#include "base/memory.h"

#include "tools/pipeline_limits.h"
#include "tools/pipeline_state.h"
#include "tools/progress.h"

namespace enfilade {

// Runs the stages that the store has not completed. The store must hold
// settings and a stage. The result is a solution that meets the settings'
// error, or the solver's verdict that it cannot be met
// (SolveSummary::converged). If a stop is requested, throws InterruptedError
// after the completed work is committed. Any other error leaves the store at
// its last commit.
SolveSummary RunPipeline(BlockStorage& store,
                         const SolveSettings& settings,
                         const RunLimits& limits,
                         MemoryBudget& budget,
                         Progress& progress);

// Runs only the stages before the solve, after which the store can be solved or
// inspected.
void PreparePipeline(BlockStorage& store,
                     const SolveSettings& settings,
                     const RunLimits& limits,
                     MemoryBudget& budget,
                     Progress& progress);

// Throws InputError if the scene's files have changed since the store was made
// from them. If some of them cannot be found but the scene is already in the
// store, returns false instead.
bool CheckSceneUnchanged(const BlockStorage& store,
                         const SolveSettings& settings);

}  // namespace enfilade
