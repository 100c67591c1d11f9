#include "solver/solve_context.h"

#include "base/random.h"
#include "base/stop.h"
#include "partition/partition_store.h"
#include "solver/least_memory.h"

#include <algorithm>
#include <utility>

namespace enfilade {
namespace {

// A cell counts as lit above this share of the mean reflected radiosity.
constexpr double kDarkShare = 1e-6;

// Adds up all patches, and makes the rows of the cells, which know their areas
// and lamps alone.
PatchTotals SurveyPatches(const BlockStorage& store,
                          const SceneInfo& scene,
                          size_t cells,
                          std::vector<CellRow>* rows) {
  PatchTotals all;
  rows->resize(cells);
  for (size_t i = 0; i < rows->size(); ++i) {
    ThrowIfStopRequested();
    CellRow& row = (*rows)[i];
    for (const Patch& p : LoadCellPatches(store, CellId(i)).patches) {
      const Material& m = scene.materials.at(p.material.Index());
      const double area = PatchArea(p);
      ++all.count;
      if (p.emits) {
        all.emitted += area * MeanChannel(m.exitance);
        row.peak =
            std::max(row.peak, static_cast<float>(MaxChannel(m.exitance)));
      }
      if (p.reflects) {
        row.area += area;
        all.reflectance_area += area * MeanChannel(m.reflectance);
      }
      all.reflecting_area += Reflects(p, scene.materials) ? area : 0;
    }
    all.receiving_area += row.area;
  }
  return all;
}

}  // namespace

MeasuredSurface::MeasuredSurface(const PatchTotals& totals)
    : is_black(totals.reflecting_area <= 0),
      area(is_black ? std::max(totals.receiving_area, 1e-12)
                    : totals.reflecting_area),
      least_reflectance(
          is_black ? kLeastWeightReflectance
                   : std::min(kLeastWeightReflectance,
                              static_cast<float>(totals.reflectance_area /
                                                 totals.reflecting_area))) {}

SolveContext::SolveContext(BlockStorage& of_store,
                           const SolveOptions& of_solve,
                           MemoryBudget& of_memory)
    : store(of_store),
      options(of_solve),
      budget(of_memory),
      scene(LoadSceneInfo(store)),
      scene_charge(budget, kSceneCopies * BytesOf(scene), kScenePurpose),
      portals_charge(budget, "the portals of the building"),
      partition(LoadPartition(
          store, [this](uint64_t bytes) { portals_charge.GrowTo(bytes); })),
      cells_charge(budget,
                   partition.cells.size() * kSolveBytesPerCell,
                   "what is known of the cells"),
      basis(BasisNamed(options.basis)),
      shape{&basis, kRgbChannels},
      surfaces(MakeSurfaceTable(scene)),
      device(budget, scene.bounds.Center()),
      pager(store, scene, partition, shape, device, budget),
      chunks(
          store,
          [this](LinkChunk&& chunk) { pager.Links().Keep(std::move(chunk)); }),
      totals(SurveyPatches(store, scene, partition.cells.size(), &state.cells)),
      surface(totals),
      is_resumed(LoadSolveState(store, &state)) {
  if (is_resumed) {
    RequireSense(state, partition.cells.size());
  }
}

bool SolveContext::IsLit(CellId cell) const {
  return static_cast<double>(state.cells[cell.Index()].peak) >
         kDarkShare * state.mean_reflected;
}

uint64_t SolveContext::SeedOfRound() const {
  return MixKey(state.seed, state.round);
}

}  // namespace enfilade
