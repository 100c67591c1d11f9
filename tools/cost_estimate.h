// What a solve will cost, before it begins: rules of thumb on what the stages
// before it have found. Measured: docs/decisions/cost-estimate.md.

#pragma once

#include "base/block_storage.h"
#include "solver/solve.h"

#include <cstdint>
#include <string>

#include "tools/report.h"

namespace enfilade {

// The links per patch at an error of 0.1 lay between 42 and 370, so that what
// is made of links may be off by this factor either way; time, which also
// depends on the machine, by twice as much.
inline constexpr double kEstimateFactor = 4;

struct CostEstimate {
  double links = 0;
  double elements = 0;
  double store_bytes = 0;           // with what the store holds already
  double solve_seconds = 0;         // in all, after the stages before it
  uint64_t least_cap_bytes = 0;     // under which the solve should end
  uint64_t cap_to_begin_bytes = 0;  // below which it is refused

  // Of a run that needs at least this cap before the solve.
  [[nodiscard]] CostEstimate WithCap(uint64_t cap_bytes) const;
};

// The store must have visible sets. Of one that was solved to some error, by
// what that took.
CostEstimate EstimateCost(const BlockStorage& store,
                          const SolveOptions& options,
                          uint64_t threads);

Json EstimateReport(const CostEstimate& estimate);

// A few lines for people.
std::string EstimateText(const CostEstimate& estimate,
                         const SolveOptions& options);

}  // namespace enfilade
