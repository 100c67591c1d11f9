#include "tools/building_store.h"

namespace enfilade {
namespace {

// Below this much free budget the tracer and the solution take turns.
constexpr uint64_t kExclusiveBelowBytes = 192ULL << 20;

}  // namespace

StoredBuilding::StoredBuilding(const BlockStorage& store, MemoryBudget& budget)
    : store_(&store),
      budget_(&budget),
      exclusive_(budget.FreeBytes() < kExclusiveBelowBytes),
      scene_(LoadSceneInfo(store)),
      partition_(LoadPartition(store)) {
  view_.scene = &scene_;
  view_.partition = &partition_;
  view_.load_cell = [this](CellId cell) {
    return LoadCellPatches(*store_, cell);
  };
  view_.trace = [this](std::span<const TraceRay> rays,
                       std::span<TraceHit> hits) {
    OpenTracer().Trace(rays, hits);
  };
  view_.radiosity = [this](std::span<const PatchPoint> points) {
    return OpenSolution().Radiosity(points);
  };
  view_.irradiance = [this](std::span<const PatchPoint> points) {
    return OpenSolution().Irradiance(points);
  };
  // Refuses a store without one before any work is done.
  static_cast<void>(OpenSolution());
}

StoredBuilding::~StoredBuilding() = default;

// The budget to open a part with: all of it when the parts take turns, else a
// share of its own, charged as a whole, that the other part cannot eat.
MemoryBudget& StoredBuilding::Share(double fraction,
                                    std::optional<MemoryBudget>& share) {
  if (exclusive_) {
    return *budget_;
  }
  const auto bytes = static_cast<uint64_t>(
      static_cast<double>(budget_->FreeBytes()) * fraction);
  share.emplace(bytes);
  return *share;
}

RayTracer& StoredBuilding::OpenTracer() {
  if (!tracer_) {
    if (exclusive_) {
      solution_.reset();
    }
    MemoryBudget& share = Share(0.5, tracer_budget_);
    if (&share != budget_) {
      tracer_charge_ =
          MemoryCharge(*budget_, share.LimitBytes(), "tracing rays");
    }
    tracer_ = std::make_unique<RayTracer>(*store_, share);
  }
  return *tracer_;
}

Solution& StoredBuilding::OpenSolution() {
  if (!solution_) {
    if (exclusive_) {
      tracer_.reset();
    }
    MemoryBudget& share = Share(0.3, solution_budget_);
    if (&share != budget_) {
      solution_charge_ =
          MemoryCharge(*budget_, share.LimitBytes(), "reading the solution");
    }
    solution_ = std::make_unique<Solution>(*store_, share);
  }
  return *solution_;
}

}  // namespace enfilade
