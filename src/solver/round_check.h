// Measures the error of a round that has ended by rays, and finds the patches
// that have most of it.

#pragma once

#include "solver/checkpoints.h"
#include "solver/solve_context.h"

namespace enfilade {

// Puts what rays say of the last round's error into its record, and raises the
// care of the patches that have most of it, so that the next round brings their
// error down to the wanted level. The round has been committed, and nothing is
// in memory: a stop leaves the store as it is.
void CheckRound(SolveContext& context, Checkpoints& checkpoints);

}  // namespace enfilade
