#include "solver/solution/display_solution.h"

#include "base/memory.h"
#include "solver/solution/cell_loader.h"
#include "solver/solution/display_cell.h"

#include <utility>

namespace enfilade {
namespace {

DisplayCell DisplayOf(const LoadedCell& cell, MemoryBudget& budget) {
  return {*cell.tree, cell.gathered, cell.stored.patches, budget};
}

}  // namespace

void ForEachDisplayMesh(
    const Solution& solution,
    CellId cell,
    const DisplayOptions& options,
    const std::function<void(const DisplayMesh&, const Patch&)>& visit) {
  const LoadedCell loaded = solution.Load(cell);
  const DisplayCell display = DisplayOf(loaded, solution.Budget());
  for (size_t g = 0; g < display.GroupCount(); ++g) {
    visit(*display.Make(g, options), display.FirstOf(g));
  }
}

// A cell and its meshes.
struct DisplaySolution::ShownCell {
  ShownCell(CellId cell, LoadedCell loaded_cell, MemoryBudget& budget)
      : id(cell),
        loaded(std::move(loaded_cell)),
        display(DisplayOf(loaded, budget)) {}

  CellId id;
  LoadedCell loaded;
  DisplayCell display;
};

DisplaySolution::DisplaySolution(const Solution& solution)
    : solution_(&solution) {}

DisplaySolution::~DisplaySolution() = default;

DisplaySolution::ShownCell& DisplaySolution::Show(CellId cell) {
  if (!shown_ || shown_->id != cell) {
    shown_.reset();  // makes room
    shown_ = std::make_unique<ShownCell>(
        cell, solution_->Load(cell), solution_->Budget());
  }
  return *shown_;
}

std::vector<Rgb> DisplaySolution::Radiosity(
    std::span<const PatchPoint> points) {
  const PointsByCell by_cell(points, solution_->CellCount());
  std::vector<Rgb> values(points.size());
  for (const size_t i : by_cell.All()) {
    const PatchPoint& p = points[i];
    ShownCell& cell = Show(p.cell);
    values[i] = solution_->RadiosityOf(
        cell.loaded.stored.patches.at(p.patch.Index()),
        NotBelowZero(cell.display.IrradianceAt(p.patch, {p.a, p.b})));
  }
  return values;
}

}  // namespace enfilade
