// Wavelet radiosity on the cells of a partition, out of core: from the visible
// sets to a stored solution.

#pragma once

#include "base/block_storage.h"
#include "base/memory.h"
#include "solver/state/solve_options.h"

namespace enfilade {

// Continues from the last commit in the store, or starts a solve. The store
// must hold scene, partition, visible sets and trace chunks. The error may
// differ from that of the run before: Solve refines a stored solution that does
// not meet the error and leaves one that does as it is. Throws DoesNotFitError
// before doing any work if the budget is less than the solve needs at least
// (least_memory.h).
SolveSummary Solve(BlockStorage& store,
                   const SolveOptions& options,
                   MemoryBudget& budget);

// The summary as last committed; all zero when the solve has not begun.
SolveSummary LoadSolveSummary(const BlockStorage& store);

}  // namespace enfilade
