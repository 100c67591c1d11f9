// Estimates the error of a solution from the solution itself. At random points,
// it compares the light that one bounce of the solution's radiosity brings
// there, found by rays over the hemisphere, with the light that the links
// brought there:
//
//   r(x) = rho(x) [ integral of G(x, y) B(y) dA_y  -  H(x) ].
//
// The residual r is 0 where B solves the radiosity equation. Rays see what the
// oracle cannot: a rim of light between the nodes of an element, and errors
// that many links share. The error is r plus what reflection makes of r
// (reflected_error.h); see docs/decisions/residual-check.md.
//
// Points and rays are random, so the product of two independent estimates of r
// estimates r^2 without bias (residual_rays.h). The loop over points is here;
// residual_estimate.h combines the points into one estimate.

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
  // Points are added until the interval of the error excludes `decide_at` after
  // at least `least_rays`, or is narrow, or until `most_rays` rays have been
  // traced.
  double decide_at = 0;
  uint64_t most_rays = 1 << 20;
  DecidingRays least_rays;
  UnseenError unseen;
  // If the flag is set, InterruptedError is thrown.
  const std::atomic<bool>* stop = nullptr;
  // Called now and then from the measuring thread. `share` is the share of
  // `most_rays` that has been traced, in [0, 1]; `so_far` is the last estimate,
  // at first one of no points.
  std::function<void(double share, const ResidualEstimate& so_far)> progress;
};

// The most rays that are worth tracing after a round with `links` links: a
// needless round of refinement costs more.
uint64_t MostResidualRays(uint64_t links);

// The least bytes that MeasureResidual() takes in a building of so many cells,
// patches and patches that emit, beside the largest cell's solution.
uint64_t LeastResidualBytes(size_t cells,
                            size_t patches,
                            size_t lamps,
                            uint64_t most_rays);

// Reads the solution and the trace chunks of the store. The result has the same
// bits for any budget and number of threads. Takes more than half of what is
// free in the budget, and at least LeastResidualBytes() and the largest cell's
// solution. If `by_patch` is not null, it receives the errors of the patches.
ResidualEstimate MeasureResidual(const BlockStorage& store,
                                 const ResidualOptions& options,
                                 MemoryBudget& budget,
                                 PatchErrors* by_patch = nullptr);

}  // namespace enfilade
