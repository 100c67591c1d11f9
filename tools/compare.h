// Compare: the deviation of one solution from another of the same scene.

#pragma once

#include "base/block_storage.h"
#include "base/memory.h"

#include <cstdint>
#include <functional>

namespace enfilade {

struct CompareOptions {
  // A patch gets at least this many sample points, and more in proportion to
  // its area: about one per sample_area_m2, up to 1024.
  uint32_t samples_per_patch = 16;
  double sample_area_m2 = 0.01;

  // Called with the fraction of cells done; may be empty; may throw to stop.
  std::function<void(double fraction)> progress;

  // Throws UsageError with what is wrong.
  void Validate() const;
};

// The deviation of A from the reference B, area-weighted over the reflecting
// patch sides and the three channels (docs/error-measure.md). The errors and
// the mean deviation are relative to B's area-weighted mean reflected
// radiosity.
struct CompareSummary {
  double rms_error = 0;
  double l1_error = 0;        // mean |A - B|
  double max_error = 0;       // largest |A - B| over the sample points
  double mean_deviation = 0;  // mean of A - B; > 0: A is brighter
  double mean_reflected = 0;  // of B, W/m2, mean over the channels
  uint64_t points = 0;
};

// Samples both solutions at the same fixed points, cell by cell. Throws
// InputError if the stores hold different scenes (source_hash) or different
// partitions of the scene, or if one holds no solution.
CompareSummary Compare(const BlockStorage& a,
                       const BlockStorage& b,
                       const CompareOptions& options,
                       MemoryBudget& budget);

}  // namespace enfilade
