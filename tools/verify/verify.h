// Verify: the error that a stored solution delivers, measured against unbiased
// Monte Carlo path tracing. Shares no sample with the solver, and no code
// but the tracer of closest hits: it knows the patches, the partition and the
// solution as a function.
// The measure, the estimator and the interval: docs/error-measure.md.

#pragma once

#include "base/block_storage.h"
#include "base/memory.h"
#include "base/photometry.h"
#include "base/vec.h"

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace enfilade {

struct VerifyOptions {
  uint64_t seed = 1;

  // Points of one round, stratified over the reflecting sides.
  // Rounds of fresh points are added until the interval is tight.
  uint32_t points_per_round = 4096;

  // Stops when the half-width of the 95 % interval is at most
  // `target_half_width`, or at most this fraction of the larger of the error
  // and `requested_error`.
  double target_relative_half_width = 0.05;
  double requested_error = 0;
  double target_half_width = 0.0005;

  // Stops, with a wider interval, before a round that would pass this limit,
  // but after at least one round. A round takes at most about a quarter of the
  // limit. The result depends on the machine's speed only if the limit ends the
  // rounds or makes them smaller.
  double max_seconds = 60;
  uint32_t max_rounds = 512;

  // Called from the calling thread between batches of rays, with the fraction
  // done as estimated so far; may be empty; may throw to stop.
  std::function<void(double fraction)> progress;

  // Throws UsageError with what is wrong.
  void Validate() const;
};

// A point where the solution was found to differ from the reference.
struct DifferingPoint {
  Point3 position;
  Vec3 normal;  // of the side that receives
  std::string material;
  Rgb solution{};   // reflected radiosity, W/m2
  Rgb reference{};  // likewise; a mean over paths, with their noise
  uint32_t paths = 0;
  // The point's share of the sum of squared errors over all points, positive.
  // It can exceed 1, because noise can make the parts of other points negative.
  double share = 0;
};

// Intervals are 95 % confidence intervals. All errors are relative to the
// reference's area-weighted mean reflected radiosity.
struct VerifySummary {
  double error = 0;      // RMS difference over points and channels
  double error_low = 0;  // the interval of `error`
  double error_high = 0;
  double mean_deviation = 0;  // mean of solution less reference; > 0: bright
  double mean_deviation_low = 0;
  double mean_deviation_high = 0;
  double mean_reflected = 0;  // of the reference, W/m2, mean over channels
  double area_m2 = 0;         // of the reflecting patch sides
  uint64_t points = 0;
  uint64_t paths = 0;
  uint64_t rays = 0;
  uint32_t rounds = 0;
  bool tight = false;  // met the target; false: stopped by a limit
  double seconds = 0;
  // The points with the largest parts in the error, largest first; at most 16.
  std::vector<DifferingPoint> largest_differences;
};

// The store must hold scene, partition, trace chunks and a solution (InputError
// otherwise). Throws InputError if no side of the scene reflects, and
// DoesNotFitError if the budget leaves no room for a batch.
VerifySummary Verify(const BlockStorage& store,
                     const VerifyOptions& options,
                     MemoryBudget& budget);

}  // namespace enfilade
