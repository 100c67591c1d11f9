// Solves by matrix, progressive or substructuring radiosity: on finer and finer
// dicings of the whole scene, each from scratch, until the difference of the
// last two solutions shows that the requested error is met. The estimate is
// explained in docs/reference-methods.md.

#pragma once

#include "base/block_storage.h"
#include "base/memory.h"
#include "solver/state/solve_options.h"

namespace enfilade {

// Writes the solution as element trees of the constant basis, and the state in
// the form of the wavelet solver; commits both after every fineness. Resuming
// begins after the last fineness that was committed. Throws DoesNotFitError if
// a fineness does not fit; the finenesses before it stay committed.
void SolveByReference(BlockStorage& store,
                      const SolveOptions& options,
                      MemoryBudget& budget);

}  // namespace enfilade
