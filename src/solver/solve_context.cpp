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

// All reflecting patches together.
struct Reflecting {
  double area = 0;         // m2; what the error is a mean over
  double reflectance = 0;  // mean over the area
};

Reflecting ReflectingPatches(const BlockStorage& store,
                             const SceneInfo& scene,
                             size_t cells) {
  Reflecting all;
  for (size_t i = 0; i < cells; ++i) {
    ThrowIfStopRequested();
    for (const Patch& p : LoadCellPatches(store, CellId(i)).patches) {
      if (Reflects(p, scene.materials)) {
        const Material& material = scene.materials[p.material.Index()];
        all.area += PatchArea(p);
        all.reflectance += PatchArea(p) * MeanChannel(material.reflectance);
      }
    }
  }
  all.reflectance /= std::max(all.area, 1e-30);
  return all;
}

}  // namespace

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
      chunks(store, [this](LinkChunk&& chunk) {
        pager.Links().Keep(std::move(chunk));
      }) {
  const Reflecting reflecting =
      ReflectingPatches(store, scene, partition.cells.size());
  area = reflecting.area;
  is_black = area <= 0;
  if (!is_black) {
    least_reflectance =
        std::min(least_reflectance, static_cast<float>(reflecting.reflectance));
  }
  is_resumed = LoadSolveState(store, &state);
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
