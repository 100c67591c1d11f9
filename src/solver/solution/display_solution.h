// The solution as it is shown: smooth meshes over coplanar patches.

#pragma once

#include "base/ids.h"
#include "base/photometry.h"
#include "partition/patch.h"
#include "solver/solution/display_mesh.h"
#include "solver/solution/points_by_cell.h"
#include "solver/solution/solution.h"

#include <functional>
#include <memory>
#include <span>
#include <vector>

namespace enfilade {

// Visits the meshes of a cell's groups of coplanar patches in a fixed order,
// each with the first patch of its group.
void ForEachDisplayMesh(
    const Solution& solution,
    CellId cell,
    const DisplayOptions& options,
    const std::function<void(const DisplayMesh&, const Patch&)>& visit);

// Radiosity at points of the smooth meshes. The last cell stays in memory with
// its meshes, so callers should ask cell by cell. Not thread-safe.
class DisplaySolution {
 public:
  // The solution is borrowed.
  explicit DisplaySolution(const Solution& solution);
  ~DisplaySolution();
  DisplaySolution(const DisplaySolution&) = delete;
  DisplaySolution& operator=(const DisplaySolution&) = delete;

  // As Solution::Radiosity().
  [[nodiscard]] std::vector<Rgb> Radiosity(std::span<const PatchPoint> points);

 private:
  struct ShownCell;

  ShownCell& Show(CellId cell);

  const Solution* solution_;
  std::unique_ptr<ShownCell> shown_;  // the cell shown last
};

}  // namespace enfilade
