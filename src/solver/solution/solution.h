// Reads the stored solution: radiosity and irradiance anywhere on the scene's
// patches. The element tree of one cell is in memory at a time, and those of a
// few others if the budget has room for them.

#pragma once

#include "base/block_storage.h"
#include "base/ids.h"
#include "base/memory.h"
#include "base/photometry.h"
#include "base/vec.h"
#include "partition/patch.h"
#include "scene/scene_store.h"
#include "solver/elements/geometry.h"
#include "solver/solution/display_mesh.h"
#include "solver/solution/points_by_cell.h"

#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

namespace enfilade {

// A leaf of an element tree: three or four corners in the order of
// AreaVector (counter-clockwise seen from the front), and the radiosity and
// irradiance that the solution has there.
struct LeafElement {
  PatchId patch;
  std::vector<Point3> corners;
  std::vector<Rgb> radiosity;   // W/m2 at the corners
  std::vector<Rgb> irradiance;  // W/m2 at the corners
};

// A leaf and its mean irradiance, W/m2.
struct LeafMean {
  PatchId patch;
  ElementFrame frame;
  double area = 0;  // m2
  Rgb irradiance{};
};

// The radiosity of a patch (a Patch or PatchGeometry) of this material that
// receives this irradiance, W/m2.
template <typename PatchLike>
Rgb RadiosityOf(const PatchLike& patch,
                const Material& material,
                const Rgb& irradiance) {
  Rgb radiosity{};
  for (size_t c = 0; c < kRgbChannels; ++c) {
    radiosity[c] =
        (patch.emits ? material.exitance[c] : 0.0) +
        (patch.reflects ? material.reflectance[c] * irradiance[c] : 0.0);
  }
  return radiosity;
}

// The light that leaves a point, and what the surface there reflects.
struct LightAtPoint {
  Rgb radiosity{};                       // W/m2
  std::optional<MaterialId> reflecting;  // none if the side reflects nothing
};

struct LoadedCell;

class Solution {
  struct Impl;

 public:
  // Throws InputError if the store holds no solution yet.
  Solution(const BlockStorage& store, MemoryBudget& budget);
  ~Solution();
  Solution(const Solution&) = delete;
  Solution& operator=(const Solution&) = delete;

  [[nodiscard]] const SceneInfo& Scene() const;
  [[nodiscard]] size_t CellCount() const;

  // The bytes of the budget that reading the largest cell takes.
  [[nodiscard]] uint64_t MostCellBytes() const;

  // One value per point, in the order of the points, none below 0; reads every
  // cell's tree at most once per call. Thread-safe.
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

  // Visits the leaves of a cell in a fixed order.
  void ForEachLeaf(CellId cell,
                   const std::function<void(const LeafElement&)>& visit) const;

  // A cell while it is in memory.
  class Cell {
   public:
    [[nodiscard]] std::span<const Patch> Patches() const;

    // Visits the leaves of `patches`, patch by patch and in a fixed order.
    void ForEachMean(std::span<const PatchId> patches,
                     const std::function<void(const LeafMean&)>& visit) const;

   private:
    friend class Solution;

    Cell(const Impl& impl, const LoadedCell& loaded)
        : impl_(&impl), loaded_(&loaded) {}

    const Impl* impl_;
    const LoadedCell* loaded_;
  };

  // Calls visit(k, cell) once for each cells[k], in parallel and in any order.
  void VisitCells(std::span<const CellId> cells,
                  const std::function<void(size_t, const Cell&)>& visit) const;

  // Cell::ForEachMean() for one cell.
  void ForEachMean(CellId cell,
                   std::span<const PatchId> patches,
                   const std::function<void(const LeafMean&)>& visit) const;

  // The radiosity of a patch that receives this irradiance, both W/m2.
  [[nodiscard]] Rgb RadiosityOf(const Patch& patch,
                                const Rgb& irradiance) const;

  // As Radiosity(), but of the smooth display meshes. The last cell stays in
  // memory with its meshes, so callers should ask cell by cell.
  [[nodiscard]] std::vector<Rgb> DisplayRadiosity(
      std::span<const PatchPoint> points) const;

  // Visits the meshes of a cell's groups of coplanar patches in a fixed order,
  // each with the first patch of its group.
  void ForEachDisplayMesh(
      CellId cell,
      const DisplayOptions& options,
      const std::function<void(const DisplayMesh&, const Patch&)>& visit) const;

  // Hash over the coefficients of all cells: equal for equal bits.
  [[nodiscard]] std::string Digest() const;

 private:
  std::unique_ptr<Impl> impl_;
};

}  // namespace enfilade
