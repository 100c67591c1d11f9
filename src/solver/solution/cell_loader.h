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

// The stored data of one cell, in memory while a caller reads them.
struct LoadedCell {
  MemoryCharge charge;
  CellPatches stored;
  std::vector<PatchGeometry> geometry;
  std::unique_ptr<CellTree> tree;  // its elements alone
  CoefficientArray gathered{1};
};

// Cells that are in memory together, ascending.
struct LoadedCells {
  // Requires that `id` is one of the cells.
  [[nodiscard]] const LoadedCell& Of(CellId id) const;

  std::span<const CellId> ids;
  std::vector<LoadedCell> cells;
};

// Thread-safe. Store, budget and scene must outlive the loader.
class CellLoader {
 public:
  CellLoader(const BlockStorage& store,
             const SceneInfo& scene,
             BasisKind basis,
             MemoryBudget& budget);

  [[nodiscard]] size_t CellCount() const { return patch_counts_.size(); }

  [[nodiscard]] const Basis& BasisOfTrees() const { return basis_; }

  [[nodiscard]] TreeShape Shape() const { return {&basis_, kRgbChannels}; }

  // The bytes that the loaded cell takes.
  [[nodiscard]] uint64_t BytesOf(CellId cell) const;

  // Loads a cell; one without a stored tree gets one element for each patch.
  // Throws DoesNotFitError if the cell does not fit.
  [[nodiscard]] LoadedCell Load(CellId cell) const;

  // Loads the first of `cells` and those after it that are to be in memory
  // together with it. The first cell must fit; the others may take half of the
  // memory that is free beside it.
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
