#include "tools/probe.h"

#include "base/error.h"

#include "tools/building_store.h"
#include "tools/probe_points.h"

namespace enfilade {

void ProbeOptions::Validate() const {
  constexpr uint32_t kMostRays = 1U << 24;
  if (gather_rays == 0 || gather_rays > kMostRays) {
    throw UsageError("--rays: a probe gathers with 1 to 16777216 rays");
  }
}

ProbeSummary Probe(const BlockStorage& store,
                   std::istream& points,
                   const std::string& name,
                   std::ostream& out,
                   const ProbeOptions& options,
                   MemoryBudget& budget) {
  options.Validate();
  StoredBuilding building(store, budget, Sharing::kShares);
  return ProbePoints(
      building.View(), points, name, out, options, building.WorkBudget());
}

}  // namespace enfilade
