#include "tools/compare.h"

#include "base/error.h"
#include "partition/partition.h"
#include "scene/scene_store.h"
#include "solver/solution/solution.h"

#include <memory>

#include "tools/building_store.h"
#include "tools/building_view.h"
#include "tools/compare_fields.h"
#include <fmt/format.h>

namespace enfilade {
namespace {

// A solution that is opened for every call, or kept open on a share.
class SolutionInTurn {
 public:
  SolutionInTurn(const BlockStorage& store,
                 MemoryBudget& budget,
                 uint64_t share_bytes)
      : store_(&store), budget_(&budget) {
    if (share_bytes > 0) {
      share_ = std::make_unique<MemoryBudget>(share_bytes);
      charge_ = MemoryCharge(budget, share_bytes, "reading a solution");
      open_ = std::make_unique<Solution>(store, *share_);
    }
  }

  [[nodiscard]] std::vector<Rgb> Radiosity(
      std::span<const PatchPoint> points) const {
    return open_ ? open_->Radiosity(points)
                 : Solution(*store_, *budget_).Radiosity(points);
  }

 private:
  const BlockStorage* store_;
  MemoryBudget* budget_;
  std::unique_ptr<MemoryBudget> share_;
  MemoryCharge charge_;
  std::unique_ptr<Solution> open_;
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
  const Partition partition = LoadWithoutPortals(b);
  RequireSameBuilding(
      LoadSceneInfo(a), scene, LoadWithoutPortals(a), partition);
  BuildingView view;
  view.scene = &scene;
  view.partition = &partition;
  view.load_cell = [&](CellId cell) { return LoadCellPatches(b, cell); };
  const uint64_t share =
      budget.FreeBytes() < kTurnsBelowBytes ? 0 : budget.FreeBytes() / 5 * 2;
  const SolutionInTurn solution_a(a, budget, share);
  const SolutionInTurn solution_b(b, budget, share);
  const auto radiosity = [](const SolutionInTurn& solution) {
    return [&solution](std::span<const PatchPoint> points) {
      return solution.Radiosity(points);
    };
  };
  return CompareFields(
      view, radiosity(solution_a), radiosity(solution_b), options, budget);
}

}  // namespace enfilade
