#include "solver/solution/cell_loader.h"

#include "base/parallel.h"
#include "partition/partition_store.h"
#include "solver/elements/received_light.h"

#include <algorithm>
#include <utility>

namespace enfilade {
namespace {

// The most cells that LoadSome() holds in memory together.
constexpr size_t kMostCells = 16;

}  // namespace

const LoadedCell& LoadedCells::Of(CellId id) const {
  const auto at = std::lower_bound(ids.begin(), ids.end(), id);
  return cells[static_cast<size_t>(at - ids.begin())];
}

CellLoader::CellLoader(const BlockStorage& store,
                       const SceneInfo& scene,
                       BasisKind basis,
                       MemoryBudget& budget)
    : store_(&store), scene_(&scene), budget_(&budget), basis_(basis) {
  for (const CellInfo& cell : LoadCells(store)) {
    patch_counts_.push_back(cell.patches);
  }
}

uint64_t CellLoader::BytesOf(CellId cell) const {
  const size_t patches = patch_counts_[cell.Index()];
  const size_t stored = CellTree::StoredSize(*store_, cell);
  const size_t elements = stored > 0 ? stored : patches;
  return patches * (sizeof(Patch) + sizeof(PatchGeometry)) +
         (stored > 0 ? CellTree::ElementBytesFor(stored)
                     : CellTree::BytesFor(patches, Shape())) +
         elements * Shape().Stride() * sizeof(float);
}

MemoryCharge CellLoader::ChargeFor(uint64_t bytes) const {
  return {*budget_, bytes, "a cell's solution"};
}

LoadedCell CellLoader::Load(CellId cell) const {
  return Load(cell, ChargeFor(BytesOf(cell)));
}

LoadedCell CellLoader::Load(CellId cell, MemoryCharge charge) const {
  LoadedCell loaded;
  loaded.charge = std::move(charge);
  loaded.stored = LoadCellPatches(*store_, cell);
  loaded.geometry = MakePatchGeometries(
      loaded.stored.patches, scene_->materials, scene_->bounds.Center());
  auto stored = CellTree::LoadElements(*store_, cell, Shape(), loaded.geometry);
  loaded.tree = std::make_unique<CellTree>(
      stored ? std::move(*stored) : CellTree(Shape(), loaded.geometry));
  loaded.gathered =
      ReceivedLight::LoadGathered(*store_, cell, Shape(), loaded.tree->Size());
  return loaded;
}

// Charges the budget for the leading cells that are to be in memory together.
// None of them is resident yet, so that each look at the resident size takes in
// all of them.
std::vector<MemoryCharge> CellLoader::ChargeSome(
    std::span<const CellId> cells) const {
  std::vector<MemoryCharge> charges;
  uint64_t coming = BytesOf(cells.front());
  charges.push_back(ChargeFor(coming));
  const uint64_t most = coming + budget_->FreeBytes() / 2;
  while (charges.size() < std::min(cells.size(), kMostCells)) {
    const uint64_t bytes = BytesOf(cells[charges.size()]);
    if (coming + bytes > most || budget_->InUseExcess(coming + bytes) > 0) {
      break;
    }
    auto charge = MemoryCharge::IfItFits(*budget_, bytes);
    if (!charge) {
      break;
    }
    charges.push_back(std::move(*charge));
    coming += bytes;
  }
  if (budget_->ResidentExcess(coming) > 0) {
    ReleaseFreedMemory();
  }
  return charges;
}

LoadedCells CellLoader::LoadSome(std::span<const CellId> cells) const {
  std::vector<MemoryCharge> charges = ChargeSome(cells);
  LoadedCells loaded{cells.first(charges.size()), {}};
  loaded.cells.resize(charges.size());
  ParallelFor(charges.size(), [&](size_t k) {
    loaded.cells[k] = Load(cells[k], std::move(charges[k]));
  });
  return loaded;
}

}  // namespace enfilade
