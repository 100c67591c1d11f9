// Solve by matrix, progressive or substructuring: finer and finer dicings of
// the whole scene, each solved from scratch, until the difference of the last
// two says that the requested error is met. Estimate:
// docs/reference-methods.md.

#pragma once

#include "base/block_storage.h"
#include "base/memory.h"
#include "solver/state/solve_options.h"

namespace enfilade {

// Writes the solution as element trees of the constant basis and the state as
// the wavelet solver does, committed after every fineness. Resuming begins at
// the last fineness that was committed. DoesNotFitError, naming the least cap,
// when not even the coarsest dicing fits.
void SolveByReference(BlockStorage& store,
                      const SolveOptions& options,
                      MemoryBudget& budget);

}  // namespace enfilade
