#include "tools/verify/verify.h"

#include "base/error.h"

#include "tools/building_store.h"
#include "tools/verify/measure.h"

namespace enfilade {

void VerifyOptions::Validate() const {
  if (points_per_round < 16) {
    throw UsageError("a round of verify needs at least 16 points");
  }
  if (!(target_relative_half_width > 0) || !(target_half_width >= 0) ||
      !(requested_error >= 0)) {
    throw UsageError(
        "--tightness: the half-width that verify aims at must be above 0");
  }
  if (!(max_seconds > 0) || max_rounds == 0) {
    throw UsageError("--seconds: the time of verify must be above 0");
  }
}

VerifySummary Verify(const BlockStorage& store,
                     const VerifyOptions& options,
                     MemoryBudget& budget) {
  options.Validate();
  StoredBuilding building(store, budget, Sharing::kTurns);
  return MeasureError(building.View(), options, building.WorkBudget());
}

}  // namespace enfilade
