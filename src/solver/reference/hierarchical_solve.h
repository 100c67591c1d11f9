// Solve by the hierarchical method: one run to its epsilon, from a store to a
// store.

#pragma once

#include "base/block_storage.h"
#include "base/memory.h"
#include "solver/state/solve_options.h"

namespace enfilade {

// Writes the solution as the wavelet solver does, committed at the end alone: a
// run that was stopped begins anew. It does not know its error, which is
// reported as 1.
void SolveHierarchically(BlockStorage& store,
                         const SolveOptions& options,
                         MemoryBudget& budget);

}  // namespace enfilade
