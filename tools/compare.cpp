#include "tools/compare.h"

#include "base/error.h"
#include "partition/partition.h"
#include "partition/partition_store.h"
#include "scene/scene_store.h"
#include "solver/solution/solution.h"

#include <array>
#include <memory>

#include "tools/building_store.h"
#include "tools/building_view.h"
#include "tools/compare_fields.h"
#include <fmt/format.h>

namespace enfilade {
namespace {

// Two solutions. Each stays open on a share of the memory. If little memory is
// free, or a share is too small for a cell, each is instead opened for every
// call with all of the memory.
class SolutionPair {
 public:
  SolutionPair(const BlockStorage& a,
               const BlockStorage& b,
               MemoryBudget& budget)
      : budget_(&budget),
        turns_(budget.FreeBytes() < kTurnsBelowBytes),
        share_bytes_(budget.FreeBytes() / 5 * 2),
        held_{Held{&a, {}, {}, {}}, Held{&b, {}, {}, {}}} {}

  [[nodiscard]] std::vector<Rgb> Radiosity(size_t which,
                                           std::span<const PatchPoint> points) {
    Held& held = held_.at(which);
    if (!turns_) {
      try {
        return Open(held).Radiosity(points);
      } catch (const DoesNotFitError&) {
        turns_ = true;
      }
      for (Held& each : held_) {
        each.solution.reset();
        each.share.reset();
        each.charge.Reset();
      }
    }
    return Solution(*held.store, *budget_).Radiosity(points);
  }

 private:
  struct Held {
    const BlockStorage* store;
    std::unique_ptr<MemoryBudget> share;
    MemoryCharge charge;  // of the share
    std::unique_ptr<Solution> solution;
  };

  const Solution& Open(Held& held) {
    if (!held.solution) {
      held.share = std::make_unique<MemoryBudget>(
          share_bytes_,
          static_cast<double>(share_bytes_) /
              static_cast<double>(budget_->LimitBytes()));
      held.charge = MemoryCharge(*budget_, share_bytes_, "reading a solution");
      held.solution = std::make_unique<Solution>(*held.store, *held.share);
    }
    return *held.solution;
  }

  MemoryBudget* budget_;
  bool turns_;
  uint64_t share_bytes_;
  std::array<Held, 2> held_;
};

void RequireSameBuilding(const SceneInfo& scene_a,
                         const SceneInfo& scene_b,
                         const Partition& a,
                         const Partition& b) {
  if (scene_a.source_hash != scene_b.source_hash) {
    throw InputError(fmt::format(
        "the stores hold different scenes, '{}' and '{}' (or the same one "
        "imported with other options); only solutions of one scene can be "
        "compared",
        scene_a.source_path,
        scene_b.source_path));
  }
  bool same = a.cells.size() == b.cells.size();
  for (size_t c = 0; same && c < a.cells.size(); ++c) {
    same = a.cells[c].patches == b.cells[c].patches;
  }
  if (!same) {
    throw InputError(
        "the stores divide the scene into different cells; solve both with the "
        "same version of the program");
  }
}

}  // namespace

void CompareOptions::Validate() const {
  if (samples_per_patch == 0 || !(sample_area_m2 > 0)) {
    throw UsageError("a comparison needs at least one sample per patch");
  }
}

CompareSummary Compare(const BlockStorage& a,
                       const BlockStorage& b,
                       const CompareOptions& options,
                       MemoryBudget& budget) {
  options.Validate();
  const SceneInfo scene = LoadSceneInfo(b);
  // Each of the two solutions holds one, too.
  const MemoryCharge scene_charge(budget, 3 * BytesOf(scene), kScenePurpose);
  const Partition partition = LoadWithoutPortals(b);
  RequireSameBuilding(
      LoadSceneInfo(a), scene, LoadWithoutPortals(a), partition);
  BuildingView view;
  view.scene = &scene;
  view.partition = &partition;
  view.load_cell = [&](CellId cell) { return LoadCellPatches(b, cell); };
  SolutionPair solutions(a, b, budget);
  const auto radiosity = [&solutions](size_t which) {
    return [&solutions, which](std::span<const PatchPoint> points) {
      return solutions.Radiosity(which, points);
    };
  };
  return CompareFields(view, radiosity(0), radiosity(1), options, budget);
}

}  // namespace enfilade
