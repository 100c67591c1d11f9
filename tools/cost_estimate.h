// Estimates the cost of a solve before it begins, by rules of thumb from what
// the earlier stages have found. Measurements: docs/decisions/cost-estimate.md.

#pragma once

#include "base/block_storage.h"
#include "base/memory.h"
#include "solver/solve.h"

#include <cstdint>
#include <string>

#include "tools/report.h"

namespace enfilade {

// The measured links per patch at an error of 0.1 lie between 40 and 380, so an
// estimate derived from links may be off by this factor either way, by more
// where bare lamps hang in small white fixtures. Time also depends on the
// machine and may be off by twice this factor.
inline constexpr double kEstimateFactor = 4;

struct CostEstimate {
  double links = 0;
  double elements = 0;
  double store_bytes = 0;           // includes what the store already holds
  double solve_seconds = 0;         // the whole solve, without earlier stages
  uint64_t least_cap_bytes = 0;     // a solve under this cap should finish
  uint64_t cap_to_begin_bytes = 0;  // a solve under a lower cap is refused

  // The estimate for a run whose earlier stages need at least this cap.
  [[nodiscard]] CostEstimate WithCap(uint64_t cap_bytes) const;
};

// The store must have visible sets. If the store was solved to some error
// already, the estimate is scaled from what that solve took.
CostEstimate EstimateCost(const BlockStorage& store,
                          const SolveOptions& options,
                          uint64_t threads,
                          MemoryBudget& budget);

Json EstimateReport(const CostEstimate& estimate);

// A few lines for people.
std::string EstimateText(const CostEstimate& estimate,
                         const SolveOptions& options);

}  // namespace enfilade
