// The error of a solution by what it implies itself: at random points, the
// light that one bounce of its radiosity brings there by rays over the
// hemisphere against the light that its links brought there,
//
//   r(x) = rho(x) [ integral of G(x, y) B(y) dA_y  -  H(x) ],
//
// which is 0 where B solves the equation. Rays see what the oracle cannot: a
// rim of light between the nodes of an element, errors that many links share.
// The error is r and what r becomes on its way through the building
// (reflected_error.h); docs/decisions/residual-check.md.
//
// Points and rays are random, so r^2 is estimated without bias by the product
// of two independent estimates of r (residual_rays.h). The loop is here; what
// its points say together is in residual_estimate.h.

#pragma once

#include "base/block_storage.h"
#include "base/memory.h"
#include "solver/residual/patch_errors.h"
#include "solver/residual/residual_estimate.h"

#include <atomic>
#include <cstdint>
#include <functional>

namespace enfilade {

struct ResidualOptions {
  uint64_t seed = 0;
  double mean_reflected = 1;  // W/m2: the error is relative to it
  // Points are added until the interval of the error does not hold this
  // value, or is narrow, or these many rays have been traced.
  double decide_at = 0;
  uint64_t most_rays = 1 << 20;
  DecidingRays least_rays;
  UnseenError unseen;
  // Where it is set, InterruptedError is thrown.
  const std::atomic<bool>* stop = nullptr;
  // Called now and then from the measuring thread; `share` of the most rays,
  // in [0, 1], and the last estimate: of no points at first.
  std::function<void(double share, const ResidualEstimate& so_far)> progress;
};

// How many rays a round of so many links is worth at most: one too many costs
// more.
uint64_t MostResidualRays(uint64_t links);

// What measuring takes at least in a building of so many cells, patches and
// patches that emit, beside the largest cell's solution.
uint64_t LeastResidualBytes(size_t cells,
                            size_t patches,
                            size_t lamps,
                            uint64_t most_rays);

// Reads the solution and the trace chunks of the store. The same bits whatever
// the budget and the threads. Takes more than half of what is free in the
// budget, and not less than LeastResidualBytes and the largest cell's solution.
// `by_patch`, where it is wanted: what the points say of each patch.
ResidualEstimate MeasureResidual(const BlockStorage& store,
                                 const ResidualOptions& options,
                                 MemoryBudget& budget,
                                 PatchErrors* by_patch = nullptr);

}  // namespace enfilade
