#include "solver/solution/solution.h"

#include "base/error.h"
#include "base/hash.h"
#include "base/parallel.h"
#include "base/stop.h"
#include "solver/elements/element_tree.h"
#include "solver/state/solve_state.h"

#include <algorithm>
#include <type_traits>

namespace enfilade {
namespace {

// The points that one thread evaluates per task, and those that all threads
// evaluate before their values are visited.
constexpr size_t kPointsPerTask = 128;
constexpr size_t kPointsAtATime = 4096;

// Calls body(k) for every k below `points`, in parallel.
template <typename Body>
void InTasks(size_t points, const Body& body) {
  const size_t tasks = (points + kPointsPerTask - 1) / kPointsPerTask;
  ParallelFor(tasks, [&](size_t task) {
    const size_t end = std::min((task + 1) * kPointsPerTask, points);
    for (size_t k = task * kPointsPerTask; k < end; ++k) {
      body(k);
    }
  });
}

BasisKind BasisOfSolution(const BlockStorage& store) {
  SolveState state;
  if (!LoadSolveState(store, &state)) {
    throw InputError(
        "the store holds no solution yet; run enfilade resume on it first");
  }
  return BasisNamed(state.basis);
}

}  // namespace

Solution::Solution(const BlockStorage& store, MemoryBudget& budget)
    : Solution(store, budget, BasisOfSolution(store)) {}

Solution::Solution(const BlockStorage& store,
                   MemoryBudget& budget,
                   BasisKind basis)
    : budget_(&budget),
      scene_(LoadSceneInfo(store)),
      loader_(store, scene_, basis, budget) {}

uint64_t Solution::MostCellBytes() const {
  uint64_t most = 0;
  for (size_t i = 0; i < CellCount(); ++i) {
    most = std::max(most, loader_.BytesOf(CellId(i)));
  }
  return most;
}

template <typename ValueAt, typename Visit>
void Solution::ForEachValue(std::span<const PatchPoint> points,
                            const ValueAt& value_at,
                            const Visit& visit) const {
  const PointsByCell by_cell(points, CellCount());
  const std::span<const CellId> cells = by_cell.Cells();
  using Value =
      std::invoke_result_t<ValueAt, const SolvedCell&, const PatchPoint&>;
  std::vector<Value> values(std::min(points.size(), kPointsAtATime));
  for (size_t first = 0; first < cells.size();) {
    const LoadedCells loaded = loader_.LoadSome(cells.subspan(first));
    auto left = by_cell.From(loaded.ids.front(), loaded.ids.back());
    while (!left.empty()) {
      const auto some = left.first(std::min(left.size(), kPointsAtATime));
      InTasks(some.size(), [&](size_t k) {
        const PatchPoint& p = points[some[k]];
        values[k] = value_at(SolvedCell(scene_, loaded.Of(p.cell)), p);
      });
      for (size_t k = 0; k < some.size(); ++k) {
        visit(some[k], values[k]);
      }
      left = left.subspan(some.size());
    }
    first += loaded.cells.size();
  }
}

std::vector<Rgb> Solution::Irradiance(
    std::span<const PatchPoint> points) const {
  std::vector<Rgb> values(points.size());
  ForEachValue(
      points,
      [](const SolvedCell& cell, const PatchPoint& p) {
        return cell.IrradianceAt(p);
      },
      [&](size_t i, const Rgb& value) { values[i] = value; });
  return values;
}

std::vector<Rgb> Solution::Radiosity(std::span<const PatchPoint> points) const {
  std::vector<Rgb> values(points.size());
  ForEachLight(points, [&](size_t i, const LightAtPoint& light) {
    values[i] = light.radiosity;
  });
  return values;
}

void Solution::ForEachLight(
    std::span<const PatchPoint> points,
    const std::function<void(size_t, const LightAtPoint&)>& visit) const {
  ForEachValue(
      points,
      [](const SolvedCell& cell, const PatchPoint& p) {
        return cell.LightAt(p);
      },
      visit);
}

void Solution::VisitCells(
    std::span<const CellId> cells,
    const std::function<void(size_t, const SolvedCell&)>& visit) const {
  for (size_t first = 0; first < cells.size();) {
    const LoadedCells loaded = loader_.LoadSome(cells.subspan(first));
    ParallelFor(loaded.cells.size(), [&](size_t k) {
      visit(first + k, SolvedCell(scene_, loaded.cells[k]));
    });
    first += loaded.cells.size();
  }
}

void Solution::ForEachLeaf(
    CellId cell, const std::function<void(const LeafElement&)>& visit) const {
  const LoadedCell loaded = Load(cell);
  SolvedCell(scene_, loaded).ForEachLeaf(visit);
}

void Solution::ForEachMean(
    CellId cell,
    std::span<const PatchId> patches,
    const std::function<void(const LeafMean&)>& visit) const {
  const LoadedCell loaded = Load(cell);
  SolvedCell(scene_, loaded).ForEachMean(patches, visit);
}

Rgb Solution::RadiosityOf(const Patch& patch, const Rgb& irradiance) const {
  return enfilade::RadiosityOf(
      patch, scene_.materials.at(patch.material.Index()), irradiance);
}

std::string Solution::Digest(
    const std::function<void(double fraction)>& progress) const {
  uint64_t digest = 0;
  for (size_t i = 0; i < CellCount(); ++i) {
    ThrowIfStopRequested();
    if (progress) {
      progress(static_cast<double>(i) / static_cast<double>(CellCount()));
    }
    const LoadedCell cell = Load(CellId(i));
    const uint64_t tree = cell.tree->Digest(cell.gathered);
    digest = HashBytes(std::as_bytes(std::span(&tree, 1)), digest);
  }
  return HexDigits(digest);
}

}  // namespace enfilade
