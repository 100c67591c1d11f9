#include "solver/solution/solution.h"

#include "base/error.h"
#include "base/hash.h"
#include "base/parallel.h"
#include "base/stop.h"
#include "partition/partition.h"
#include "solver/elements/basis.h"
#include "solver/elements/element_tree.h"
#include "solver/solution/cell_loader.h"
#include "solver/solution/display_cell.h"
#include "solver/solution/points_by_cell.h"
#include "solver/state/solve_state.h"

#include <algorithm>
#include <mutex>
#include <type_traits>
#include <utility>

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

// Where a polynomial is below 0, 0 is nearer to the true irradiance.
Rgb NotBelowZero(Rgb value) {
  for (double& channel : value) {
    channel = std::max(channel, 0.0);
  }
  return value;
}

}  // namespace

struct Solution::Impl {
  Impl(const BlockStorage& s, MemoryBudget& b, BasisKind kind)
      : budget(&b),
        scene(LoadSceneInfo(s)),
        loader(s, scene, kind, b),
        basis(&loader.BasisOfTrees()) {}

  // Calls body(i, cell) for each of the cells, in parallel.
  template <typename Body>
  void ForEachLoaded(std::span<const CellId> cells, const Body& body) const;

  // The value may be below 0.
  [[nodiscard]] Rgb IrradianceAt(const LoadedCell& cell,
                                 PatchId patch,
                                 UnitPoint p) const;

  [[nodiscard]] Rgb IrradianceAt(const LoadedCell& cell,
                                 const PatchPoint& p) const {
    return NotBelowZero(IrradianceAt(cell, p.patch, {p.a, p.b}));
  }

  using Irradiance = std::array<float, kRgbChannels * kMaxNodes>;
  void VisitMeans(const LoadedCell& cell,
                  ElementId element,
                  const Irradiance& above,
                  const std::function<void(const LeafMean&)>& visit) const;
  template <typename PatchLike>
  [[nodiscard]] Rgb RadiosityOf(const PatchLike& patch,
                                const Rgb& irradiance) const;
  [[nodiscard]] LightAtPoint LightAt(const LoadedCell& cell,
                                     const PatchPoint& point) const;

  // Calls visit(i, value_at(cell, point)) for all points: `visit` from this
  // thread, in the order that ForEachLight() states, and `value_at` in
  // parallel.
  template <typename ValueAt, typename Visit>
  void ForEachValue(std::span<const PatchPoint> points,
                    const ValueAt& value_at,
                    const Visit& visit) const;

  // A cell and its display meshes.
  struct ShownCell {
    ShownCell(CellId cell, LoadedCell loaded_cell, MemoryBudget& budget)
        : id(cell),
          loaded(std::move(loaded_cell)),
          display(
              *loaded.tree, loaded.gathered, loaded.stored.patches, budget) {}

    CellId id;
    LoadedCell loaded;
    DisplayCell display;
  };

  // Requires that the caller holds `show_mutex`.
  ShownCell& Show(CellId cell) {
    if (!shown || shown->id != cell) {
      shown.reset();
      shown = std::make_unique<ShownCell>(cell, loader.Load(cell), *budget);
    }
    return *shown;
  }

  MemoryBudget* budget;
  SceneInfo scene;
  CellLoader loader;
  const Basis* basis;  // the loader's
  std::mutex show_mutex;
  std::unique_ptr<ShownCell> shown;  // the cell shown last
};

Rgb Solution::Impl::IrradianceAt(const LoadedCell& cell,
                                 PatchId patch,
                                 UnitPoint p) const {
  const PatchShape shape = cell.geometry.at(patch.Index()).shape;
  const ShapeBasis& on = basis->On(shape);
  const size_t nodes = basis->parallelogram.NodeCount();
  Rgb sum{};
  ElementId e(patch.value);
  while (true) {
    const auto values = on.Evaluate(p);
    const auto gathered = cell.gathered[e];
    for (size_t c = 0; c < sum.size(); ++c) {
      for (size_t q = 0; q < on.NodeCount(); ++q) {
        sum[c] += values[q] * static_cast<double>(gathered[c * nodes + q]);
      }
    }
    const uint32_t first = cell.tree->At(e).first_child;
    if (first == 0) {
      return sum;
    }
    e = ElementId(first + ChildAt(shape, &p));
  }
}

// `above` is the irradiance that the element's ancestors bring to its nodes.
void Solution::Impl::VisitMeans(
    const LoadedCell& cell,
    ElementId element,
    const Irradiance& above,
    const std::function<void(const LeafMean&)>& visit) const {
  const Element& e = cell.tree->At(element);
  const PatchGeometry& patch = cell.geometry[e.patch];
  const ShapeBasis& on = basis->On(patch.shape);
  const TreeShape shape = loader.Shape();
  Irradiance all = above;
  const auto own = cell.gathered[element];
  for (size_t k = 0; k < own.size(); ++k) {
    all[k] += own[k];
  }
  if (e.first_child != 0) {
    for (size_t c = 0; c < kChildren; ++c) {
      Irradiance pushed{};
      PushTo(on,
             shape,
             c,
             std::span(all).first(own.size()),
             std::span(pushed).first(own.size()));
      VisitMeans(cell, ElementId(e.first_child + c), pushed, visit);
    }
    return;
  }
  LeafMean leaf = {PatchId(e.patch),
                   e.frame,
                   static_cast<double>(AreaOf(patch, e.frame)),
                   {}};
  for (size_t c = 0; c < kRgbChannels; ++c) {
    for (size_t q = 0; q < on.NodeCount(); ++q) {
      leaf.irradiance[c] +=
          on.Weight(q) * static_cast<double>(all[c * shape.NodeStride() + q]);
    }
  }
  visit(leaf);
}

template <typename PatchLike>
Rgb Solution::Impl::RadiosityOf(const PatchLike& patch,
                                const Rgb& irradiance) const {
  return enfilade::RadiosityOf(
      patch, scene.materials.at(patch.material.Index()), irradiance);
}

template <typename Body>
void Solution::Impl::ForEachLoaded(std::span<const CellId> cells,
                                   const Body& body) const {
  for (size_t first = 0; first < cells.size();) {
    const LoadedCells loaded = loader.LoadSome(cells.subspan(first));
    ParallelFor(loaded.cells.size(),
                [&](size_t k) { body(first + k, loaded.cells[k]); });
    first += loaded.cells.size();
  }
}

template <typename ValueAt, typename Visit>
void Solution::Impl::ForEachValue(std::span<const PatchPoint> points,
                                  const ValueAt& value_at,
                                  const Visit& visit) const {
  const PointsByCell by_cell(points, loader.CellCount());
  const std::span<const CellId> cells = by_cell.Cells();
  using Value =
      std::invoke_result_t<ValueAt, const LoadedCell&, const PatchPoint&>;
  std::vector<Value> values(std::min(points.size(), kPointsAtATime));
  for (size_t first = 0; first < cells.size();) {
    const LoadedCells loaded = loader.LoadSome(cells.subspan(first));
    auto left = by_cell.From(loaded.ids.front(), loaded.ids.back());
    while (!left.empty()) {
      const auto some = left.first(std::min(left.size(), kPointsAtATime));
      InTasks(some.size(), [&](size_t k) {
        const PatchPoint& p = points[some[k]];
        values[k] = value_at(loaded.Of(p.cell), p);
      });
      for (size_t k = 0; k < some.size(); ++k) {
        visit(some[k], values[k]);
      }
      left = left.subspan(some.size());
    }
    first += loaded.cells.size();
  }
}

LightAtPoint Solution::Impl::LightAt(const LoadedCell& cell,
                                     const PatchPoint& point) const {
  const PatchGeometry& patch = cell.geometry.at(point.patch.Index());
  LightAtPoint light;
  light.radiosity = RadiosityOf(patch, IrradianceAt(cell, point));
  if (patch.reflects) {
    light.reflecting = patch.material;
  }
  return light;
}

Solution::Solution(const BlockStorage& store, MemoryBudget& budget) {
  SolveState state;
  if (!LoadSolveState(store, &state)) {
    throw InputError(
        "the store holds no solution yet; run enfilade resume on it first");
  }
  impl_ = std::make_unique<Impl>(store, budget, BasisNamed(state.basis));
}

Solution::~Solution() = default;

const SceneInfo& Solution::Scene() const {
  return impl_->scene;
}

size_t Solution::CellCount() const {
  return impl_->loader.CellCount();
}

uint64_t Solution::MostCellBytes() const {
  uint64_t most = 0;
  for (size_t i = 0; i < CellCount(); ++i) {
    most = std::max(most, impl_->loader.BytesOf(CellId(i)));
  }
  return most;
}

std::vector<Rgb> Solution::Irradiance(
    std::span<const PatchPoint> points) const {
  std::vector<Rgb> values(points.size());
  impl_->ForEachValue(
      points,
      [this](const LoadedCell& cell, const PatchPoint& p) {
        return impl_->IrradianceAt(cell, p);
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
  impl_->ForEachValue(
      points,
      [this](const LoadedCell& cell, const PatchPoint& p) {
        return impl_->LightAt(cell, p);
      },
      visit);
}

void Solution::ForEachLeaf(
    CellId cell, const std::function<void(const LeafElement&)>& visit) const {
  const LoadedCell loaded = impl_->loader.Load(cell);
  for (size_t i = 0; i < loaded.tree->Size(); ++i) {
    const Element& e = loaded.tree->At(ElementId(i));
    if (e.first_child != 0) {
      continue;
    }
    const Patch& patch = loaded.stored.patches[e.patch];
    LeafElement leaf;
    leaf.patch = PatchId(e.patch);
    for (size_t k = 0; k < CornerCount(patch.shape); ++k) {
      const UnitPoint at = UnitCorner(patch.shape, k);
      const double a = static_cast<double>(e.frame.a) +
                       static_cast<double>(e.frame.scale) * at.a;
      const double b = static_cast<double>(e.frame.b) +
                       static_cast<double>(e.frame.scale) * at.b;
      leaf.corners.push_back(PointOn(patch, a, b));
      // Evaluates a hair inside the leaf, so that IrradianceAt() reads this
      // leaf and not a neighbour.
      const double middle = CentroidCoordinate(patch.shape);
      const double s = at.a + (middle - at.a) * 1e-6;
      const double t = at.b + (middle - at.b) * 1e-6;
      leaf.irradiance.push_back(
          impl_->IrradianceAt(loaded,
                              leaf.patch,
                              {static_cast<double>(e.frame.a) +
                                   static_cast<double>(e.frame.scale) * s,
                               static_cast<double>(e.frame.b) +
                                   static_cast<double>(e.frame.scale) * t}));
      leaf.radiosity.push_back(
          impl_->RadiosityOf(loaded.geometry[e.patch], leaf.irradiance.back()));
    }
    visit(leaf);
  }
}

std::span<const Patch> Solution::Cell::Patches() const {
  return loaded_->stored.patches;
}

void Solution::Cell::ForEachMean(
    std::span<const PatchId> patches,
    const std::function<void(const LeafMean&)>& visit) const {
  for (const PatchId patch : patches) {
    impl_->VisitMeans(*loaded_, ElementId(patch.value), {}, visit);
  }
}

void Solution::VisitCells(
    std::span<const CellId> cells,
    const std::function<void(size_t, const Cell&)>& visit) const {
  impl_->ForEachLoaded(cells, [&](size_t k, const LoadedCell& loaded) {
    visit(k, Cell(*impl_, loaded));
  });
}

void Solution::ForEachMean(
    CellId cell,
    std::span<const PatchId> patches,
    const std::function<void(const LeafMean&)>& visit) const {
  Cell(*impl_, impl_->loader.Load(cell)).ForEachMean(patches, visit);
}

Rgb Solution::RadiosityOf(const Patch& patch, const Rgb& irradiance) const {
  return impl_->RadiosityOf(patch, irradiance);
}

std::vector<Rgb> Solution::DisplayRadiosity(
    std::span<const PatchPoint> points) const {
  const std::lock_guard lock(impl_->show_mutex);
  const PointsByCell by_cell(points, CellCount());
  std::vector<Rgb> values(points.size());
  for (const size_t i : by_cell.All()) {
    const PatchPoint& p = points[i];
    Impl::ShownCell& cell = impl_->Show(p.cell);
    values[i] =
        impl_->RadiosityOf(cell.loaded.stored.patches.at(p.patch.Index()),
                           cell.display.IrradianceAt(p.patch, {p.a, p.b}));
  }
  return values;
}

void Solution::ForEachDisplayMesh(
    CellId cell,
    const DisplayOptions& options,
    const std::function<void(const DisplayMesh&, const Patch&)>& visit) const {
  const LoadedCell loaded = impl_->loader.Load(cell);
  const DisplayCell display(
      *loaded.tree, loaded.gathered, loaded.stored.patches, *impl_->budget);
  for (size_t g = 0; g < display.GroupCount(); ++g) {
    visit(*display.Make(g, options), display.FirstOf(g));
  }
}

std::string Solution::Digest() const {
  uint64_t digest = 0;
  for (size_t i = 0; i < CellCount(); ++i) {
    ThrowIfStopRequested();
    const LoadedCell cell = impl_->loader.Load(CellId(i));
    const uint64_t tree = cell.tree->Digest(cell.gathered);
    digest = HashBytes(std::as_bytes(std::span(&tree, 1)), digest);
  }
  return HexDigits(digest);
}

}  // namespace enfilade
