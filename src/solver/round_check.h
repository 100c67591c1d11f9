// Measures the error of a round that has ended by rays, and finds the patches
// that have most of it.

#pragma once

#include "solver/checkpoints.h"
#include "solver/residual/residual_estimate.h"
#include "solver/solve_context.h"

namespace enfilade {

// Puts what rays say of the last round's error into its record, and raises the
// care of the patches that have most of it, so that the next round brings their
// error down to the wanted level; after the first round, which is a guess,
// none. Requires that the round was committed and that the pager was emptied,
// since the rays need its memory. A stop leaves the store as it is. Returns the
// estimate.
ResidualEstimate CheckRound(SolveContext& context, Checkpoints& checkpoints);

}  // namespace enfilade
