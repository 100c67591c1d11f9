// Solve by the hierarchical method: one run to its epsilon, from a store to a
// store.

#pragma once

#include "base/block_storage.h"
#include "base/memory.h"
#include "solver/state/solve_options.h"

namespace enfilade {

// Writes the solution in the form of the wavelet solver and commits only at the
// end, so a run that was stopped begins anew. The method does not know its
// error and reports 1.
void SolveHierarchically(BlockStorage& store,
                         const SolveOptions& options,
                         MemoryBudget& budget);

}  // namespace enfilade
