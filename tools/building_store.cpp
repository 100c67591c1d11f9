#include "tools/building_store.h"

#include "base/error.h"
#include "base/stop.h"
#include "partition/partition_store.h"

#include <algorithm>

namespace enfilade {
namespace {

// Of a cell in the partition, and in the lists by cell that readers make.
constexpr uint64_t kBytesPerCell = 200;
constexpr uint64_t kMostWorkBytes = 256ULL << 20;

// If both are open, a fifth is left to the caller.
constexpr double kTracerShare = 0.5;
constexpr double kSolutionShare = 0.3;

// The bytes set aside for the outputs: a smaller part if they only stream.
uint64_t WorkBytes(const MemoryBudget& budget, Sharing sharing) {
  const uint64_t tenths = sharing == Sharing::kAlone ? 1 : 3;
  return std::min(budget.FreeBytes() / 10 * tenths, kMostWorkBytes);
}

double ShareOf(const MemoryBudget& whole, uint64_t bytes) {
  return static_cast<double>(std::max<uint64_t>(bytes, 1)) /
         static_cast<double>(whole.LimitBytes());
}

}  // namespace

StoredBuilding::StoredBuilding(const BlockStorage& store,
                               MemoryBudget& budget,
                               Sharing sharing)
    : store_(&store),
      budget_(&budget),
      portals_charge_(budget, "the portals of the building"),
      scene_(LoadSceneInfo(store)),
      scene_charge_(budget, kSceneCopies * BytesOf(scene_), kScenePurpose),
      partition_(LoadPartition(
          store, [this](uint64_t bytes) { portals_charge_.GrowTo(bytes); })),
      cells_charge_(budget,
                    partition_.cells.size() * kBytesPerCell,
                    "what is known of the cells"),
      turns_(sharing == Sharing::kAlone ||
             (sharing == Sharing::kTurns &&
              budget.FreeBytes() < kTurnsBelowBytes)),
      work_budget_(WorkBytes(budget, sharing),
                   ShareOf(budget, WorkBytes(budget, sharing))),
      work_charge_(budget, work_budget_.LimitBytes(), "the work on outputs") {
  view_.scene = &scene_;
  view_.partition = &partition_;
  view_.load_cell = [this](CellId cell) {
    ThrowIfStopRequested();  // what reads all cells may take long
    return LoadCellPatches(*store_, cell);
  };
  view_.trace = [this](std::span<const TraceRay> rays,
                       std::span<TraceHit> hits) {
    CallWithin([&] { OpenTracer().Trace(rays, hits); });
  };
  view_.trace_parts = [this] {
    size_t parts = 1;
    CallWithin([&] { parts = OpenTracer().Parts(); });
    return parts;
  };
  view_.radiosity = [this](std::span<const PatchPoint> points) {
    std::vector<Rgb> values;
    CallWithin([&] { values = OpenSolution().Radiosity(points); });
    return values;
  };
  view_.irradiance = [this](std::span<const PatchPoint> points) {
    std::vector<Rgb> values;
    CallWithin([&] { values = OpenSolution().Irradiance(points); });
    return values;
  };
  view_.display_radiosity = [this](std::span<const PatchPoint> points) {
    std::vector<Rgb> values;
    CallWithin([&] { values = OpenShown().Radiosity(points); });
    return values;
  };
  view_.for_each_mean = [this](
                            CellId cell,
                            std::span<const PatchId> patches,
                            const std::function<void(const LeafMean&)>& visit) {
    // Loading the cell is what may not fit. It happens before any visit, so
    // that a repeated call visits nothing twice.
    CallWithin([&] { OpenSolution().ForEachMean(cell, patches, visit); });
  };
  // Throws before any work is done if the store holds no solution.
  CallWithin([&] { static_cast<void>(OpenSolution()); });
}

StoredBuilding::~StoredBuilding() = default;

void StoredBuilding::CloseSolution() {
  shown_.reset();
  solution_.reset();
}

void StoredBuilding::Close() {
  tracer_.reset();
  CloseSolution();
  tracer_charge_.Reset();
  solution_charge_.Reset();
}

// Makes the call. If a share is too small for it, repeats the call with the
// whole budget.
template <typename Call>
void StoredBuilding::CallWithin(const Call& call) {
  try {
    call();
    return;
  } catch (const DoesNotFitError&) {
    if (turns_) {
      throw;
    }
  }
  turns_ = true;
  Close();
  call();
}

// The budget to open the tracer or the solution with. If they take turns, it is
// the whole budget; else a share of what is free while neither is open, charged
// in full so that the other part cannot use it.
MemoryBudget& StoredBuilding::Share(double fraction,
                                    std::optional<MemoryBudget>& share,
                                    MemoryCharge& charge) {
  if (turns_) {
    return *budget_;
  }
  const uint64_t both =
      budget_->FreeBytes() + tracer_charge_.Bytes() + solution_charge_.Bytes();
  const uint64_t bytes =
      std::min(static_cast<uint64_t>(static_cast<double>(both) * fraction),
               budget_->FreeBytes());
  share.emplace(bytes, ShareOf(*budget_, bytes));
  charge = MemoryCharge(*budget_, bytes, "tracing rays in a solution");
  return *share;
}

RayTracer& StoredBuilding::OpenTracer() {
  if (!tracer_) {
    if (turns_) {
      CloseSolution();
    }
    tracer_ = std::make_unique<RayTracer>(
        *store_, Share(kTracerShare, tracer_budget_, tracer_charge_));
  }
  return *tracer_;
}

Solution& StoredBuilding::OpenSolution() {
  if (!solution_) {
    if (turns_) {
      tracer_.reset();
    }
    solution_ = std::make_unique<Solution>(
        *store_, Share(kSolutionShare, solution_budget_, solution_charge_));
  }
  return *solution_;
}

DisplaySolution& StoredBuilding::OpenShown() {
  const Solution& solution = OpenSolution();
  if (!shown_) {
    shown_ = std::make_unique<DisplaySolution>(solution);
  }
  return *shown_;
}

}  // namespace enfilade
