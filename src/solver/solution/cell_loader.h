// Cells of a stored solution in memory, each charged to the budget.

#pragma once

#include "base/block_storage.h"
#include "base/ids.h"
#include "base/memory.h"
#include "partition/partition.h"
#include "scene/scene_store.h"
#include "solver/elements/basis.h"
#include "solver/elements/element_tree.h"
#include "solver/elements/geometry.h"

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace enfilade {

// What is stored of a cell, as long as somebody reads it.
struct LoadedCell {
  MemoryCharge charge;
  CellPatches stored;
  std::vector<PatchGeometry> geometry;
  std::unique_ptr<CellTree> tree;  // its elements alone
  CoefficientArray gathered{1};
};

// Cells that are in memory together, ascending.
struct LoadedCells {
  // Requires that it is one of them.
  [[nodiscard]] const LoadedCell& Of(CellId id) const;

  std::span<const CellId> ids;
  std::vector<LoadedCell> cells;
};

// Thread-safe. Store, budget and scene must outlive it.
class CellLoader {
 public:
  CellLoader(const BlockStorage& store,
             const SceneInfo& scene,
             BasisKind basis,
             MemoryBudget& budget);

  [[nodiscard]] size_t CellCount() const { return patch_counts_.size(); }

  [[nodiscard]] const Basis& BasisOfTrees() const { return basis_; }

  [[nodiscard]] TreeShape Shape() const { return {&basis_, kRgbChannels}; }

  // What a loaded cell takes.
  [[nodiscard]] uint64_t BytesOf(CellId cell) const;

  // A cell without a tree has one element for each patch. Throws
  // DoesNotFitError if it does not fit.
  [[nodiscard]] LoadedCell Load(CellId cell) const;

  // Of some cells, from the first on, those that are to be in memory together:
  // the first must fit, the others may take a half of what is left beside it.
  [[nodiscard]] LoadedCells LoadSome(std::span<const CellId> cells) const;

 private:
  [[nodiscard]] MemoryCharge ChargeFor(uint64_t bytes) const;
  [[nodiscard]] std::vector<MemoryCharge> ChargeSome(
      std::span<const CellId> cells) const;
  [[nodiscard]] LoadedCell Load(CellId cell, MemoryCharge charge) const;

  const BlockStorage* store_;
  const SceneInfo* scene_;
  MemoryBudget* budget_;
  Basis basis_;
  std::vector<uint32_t> patch_counts_;  // by cell
};

}  // namespace enfilade
