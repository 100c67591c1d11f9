// Reads the stored solution: radiosity and irradiance anywhere on the scene's
// patches. The element tree of one cell is in memory at a time, and those of a
// few others if the budget has room for them.

#pragma once

#include "base/block_storage.h"
#include "base/ids.h"
#include "base/memory.h"
#include "base/photometry.h"
#include "partition/patch.h"
#include "scene/scene_store.h"
#include "solver/elements/basis.h"
#include "solver/solution/cell_loader.h"
#include "solver/solution/points_by_cell.h"
#include "solver/solution/solved_cell.h"

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

namespace enfilade {

// Thread-safe. Store and budget must outlive the solution.
class Solution {
 public:
  // Throws InputError if the store holds no solution yet.
  Solution(const BlockStorage& store, MemoryBudget& budget);
  ~Solution() = default;
  Solution(const Solution&) = delete;
  Solution& operator=(const Solution&) = delete;

  [[nodiscard]] const SceneInfo& Scene() const { return scene_; }

  [[nodiscard]] MemoryBudget& Budget() const { return *budget_; }

  [[nodiscard]] size_t CellCount() const { return loader_.CellCount(); }

  // The bytes of the budget that reading the largest cell takes.
  [[nodiscard]] uint64_t MostCellBytes() const;

  // Takes a cell into memory. Throws DoesNotFitError.
  [[nodiscard]] LoadedCell Load(CellId cell) const {
    return loader_.Load(cell);
  }

  // One value per point, in the order of the points, none below 0; reads every
  // cell's tree at most once per call.
  [[nodiscard]] std::vector<Rgb> Irradiance(
      std::span<const PatchPoint> points) const;
  [[nodiscard]] std::vector<Rgb> Radiosity(
      std::span<const PatchPoint> points) const;

  // As Radiosity(), without an array of all values: calls visit(i, light) from
  // this thread, cell by cell in ascending order, and within a cell in the
  // order of the points.
  void ForEachLight(
      std::span<const PatchPoint> points,
      const std::function<void(size_t, const LightAtPoint&)>& visit) const;

  // Calls visit(k, cell) once for each cells[k], in parallel and in any order.
  void VisitCells(
      std::span<const CellId> cells,
      const std::function<void(size_t, const SolvedCell&)>& visit) const;

  // SolvedCell::ForEachLeaf() and ForEachMean() for one cell.
  void ForEachLeaf(CellId cell,
                   const std::function<void(const LeafElement&)>& visit) const;
  void ForEachMean(CellId cell,
                   std::span<const PatchId> patches,
                   const std::function<void(const LeafMean&)>& visit) const;

  // The radiosity of a patch that receives this irradiance, both W/m2.
  [[nodiscard]] Rgb RadiosityOf(const Patch& patch,
                                const Rgb& irradiance) const;

  // Hash over the coefficients of all cells: equal for equal bits. `progress`
  // is told the fraction of the cells that are read, and may be empty. Throws
  // InterruptedError if a stop is requested.
  [[nodiscard]] std::string Digest(
      const std::function<void(double fraction)>& progress = {}) const;

 private:
  Solution(const BlockStorage& store, MemoryBudget& budget, BasisKind basis);

  // Calls visit(i, value_at(cell, point)) for all points: `visit` from this
  // thread, in the order that ForEachLight() states, and `value_at` in
  // parallel.
  template <typename ValueAt, typename Visit>
  void ForEachValue(std::span<const PatchPoint> points,
                    const ValueAt& value_at,
                    const Visit& visit) const;

  MemoryBudget* budget_;
  SceneInfo scene_;
  CellLoader loader_;
};

}  // namespace enfilade
