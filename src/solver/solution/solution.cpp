#include "solver/solution/solution.h"

#include "base/error.h"
#include "base/hash.h"
#include "base/parallel.h"
#include "partition/partition.h"
#include "solver/elements/basis.h"
#include "solver/elements/element_tree.h"
#include "solver/elements/received_light.h"
#include "solver/solution/display_cell.h"
#include "solver/solution/points_by_cell.h"
#include "solver/state/solve_state.h"

#include <algorithm>
#include <mutex>
#include <utility>

namespace enfilade {
namespace {

// Points that are evaluated by one thread in one go.
constexpr size_t kPointsPerTask = 512;

// Cells that are in memory together, at most.
constexpr size_t kMostCells = 16;

std::vector<PatchGeometry> MakeGeometry(const CellPatches& cell,
                                        const SceneInfo& scene) {
  std::vector<PatchGeometry> geometry;
  geometry.reserve(cell.patches.size());
  for (const Patch& p : cell.patches) {
    geometry.push_back(MakePatchGeometry(
        p, scene.materials.at(p.material.Index()), scene.bounds.Center()));
  }
  return geometry;
}

// Where the polynomials swing below 0, 0 is nearer to the truth.
Rgb NotBelowZero(Rgb value) {
  for (double& channel : value) {
    channel = std::max(channel, 0.0);
  }
  return value;
}

}  // namespace

// A cell's trees, as long as somebody reads them.
struct Solution::LoadedCell {
  MemoryCharge charge;
  CellPatches stored;
  std::vector<PatchGeometry> geometry;
  std::unique_ptr<CellTree> tree;  // its elements alone
  CoefficientArray gathered{1};
};

struct Solution::Impl {
  Impl(const BlockStorage& s, MemoryBudget& b, BasisKind kind)
      : store(&s), budget(&b), scene(LoadSceneInfo(s)), basis(kind) {
    for (const CellInfo& cell : LoadPartition(s).cells) {
      patch_counts.push_back(cell.patches);
    }
  }

  [[nodiscard]] MemoryCharge ChargeFor(uint64_t bytes) const {
    return {*budget, bytes, "a cell's solution"};
  }

  [[nodiscard]] LoadedCell Load(CellId cell) const {
    return Load(cell, ChargeFor(BytesOf(cell)));
  }

  [[nodiscard]] LoadedCell Load(CellId cell, MemoryCharge charge) const {
    LoadedCell loaded;
    loaded.charge = std::move(charge);
    loaded.stored = LoadCellPatches(*store, cell);
    loaded.geometry = MakeGeometry(loaded.stored, scene);
    auto stored =
        CellTree::LoadElements(*store, cell, Shape(), loaded.geometry);
    loaded.tree = std::make_unique<CellTree>(
        stored ? std::move(*stored) : CellTree(Shape(), loaded.geometry));
    loaded.gathered =
        ReceivedLight::LoadGathered(*store, cell, Shape(), loaded.tree->Size());
    return loaded;
  }

  // Calls body(i, cell) for all of the cells, in parallel. The first of those
  // that are in memory together must fit; the others may take a half of what is
  // left beside it.
  template <typename Body>
  void ForEachLoaded(std::span<const CellId> cells, const Body& body) const;
  [[nodiscard]] std::vector<MemoryCharge> ChargeSome(
      std::span<const CellId> cells) const;

  [[nodiscard]] TreeShape Shape() const { return {&basis, kRgbChannels}; }

  // What a loaded cell takes.
  [[nodiscard]] uint64_t BytesOf(CellId cell) const {
    const size_t patches = patch_counts[cell.Index()];
    const size_t stored = CellTree::StoredSize(*store, cell);
    const size_t elements = stored > 0 ? stored : patches;
    return patches * (sizeof(Patch) + sizeof(PatchGeometry)) +
           (stored > 0 ? CellTree::ElementBytesFor(stored)
                       : CellTree::BytesFor(patches, Shape())) +
           elements * Shape().Stride() * sizeof(float);
  }

  [[nodiscard]] Rgb IrradianceAt(const LoadedCell& cell,
                                 PatchId patch,
                                 UnitPoint p) const;
  using Irradiance = std::array<float, kRgbChannels * kMaxNodes>;
  void VisitMeans(const LoadedCell& cell,
                  ElementId element,
                  const Irradiance& above,
                  const std::function<void(const LeafMean&)>& visit) const;
  template <typename PatchLike>
  [[nodiscard]] Rgb RadiosityOf(const PatchLike& patch,
                                const Rgb& irradiance) const;
  [[nodiscard]] std::vector<Rgb> Evaluate(std::span<const PatchPoint> points,
                                          bool radiosity) const;

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

  // Requires `show_mutex`.
  ShownCell& Show(CellId cell) {
    if (!shown || shown->id != cell) {
      shown.reset();
      shown = std::make_unique<ShownCell>(cell, Load(cell), *budget);
    }
    return *shown;
  }

  const BlockStorage* store;
  MemoryBudget* budget;
  SceneInfo scene;
  Basis basis;
  std::vector<uint32_t> patch_counts;  // by cell
  std::mutex show_mutex;
  std::unique_ptr<ShownCell> shown;  // the last one
};

Rgb Solution::Impl::IrradianceAt(const LoadedCell& cell,
                                 PatchId patch,
                                 UnitPoint p) const {
  const PatchShape shape = cell.geometry.at(patch.Index()).shape;
  const ShapeBasis& on = basis.On(shape);
  const size_t nodes = basis.parallelogram.NodeCount();
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

// `above`: what the elements above bring to the nodes of this one.
void Solution::Impl::VisitMeans(
    const LoadedCell& cell,
    ElementId element,
    const Irradiance& above,
    const std::function<void(const LeafMean&)>& visit) const {
  const Element& e = cell.tree->At(element);
  const PatchGeometry& patch = cell.geometry[e.patch];
  const ShapeBasis& on = basis.On(patch.shape);
  const TreeShape shape = Shape();
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
  const Material& m = scene.materials.at(patch.material.Index());
  Rgb b{};
  for (size_t c = 0; c < b.size(); ++c) {
    b[c] = (patch.emits ? m.exitance[c] : 0.0) +
           (patch.reflects ? m.reflectance[c] * irradiance[c] : 0.0);
  }
  return b;
}

// For as many cells from the first on as are to be in memory together.
std::vector<MemoryCharge> Solution::Impl::ChargeSome(
    std::span<const CellId> cells) const {
  std::vector<MemoryCharge> charges;
  charges.push_back(ChargeFor(BytesOf(cells.front())));
  uint64_t room = budget->FreeBytes() / 2;
  while (charges.size() < std::min(cells.size(), kMostCells)) {
    const uint64_t bytes = BytesOf(cells[charges.size()]);
    if (bytes > room || budget->ResidentExcess(bytes) > 0) {
      break;
    }
    auto charge = MemoryCharge::IfItFits(*budget, bytes);
    if (!charge) {
      break;
    }
    charges.push_back(std::move(*charge));
    room -= bytes;
  }
  return charges;
}

template <typename Body>
void Solution::Impl::ForEachLoaded(std::span<const CellId> cells,
                                   const Body& body) const {
  for (size_t first = 0; first < cells.size();) {
    std::vector<MemoryCharge> charges = ChargeSome(cells.subspan(first));
    ParallelFor(charges.size(), [&](size_t k) {
      body(first + k, Load(cells[first + k], std::move(charges[k])));
    });
    first += charges.size();
  }
}

std::vector<Rgb> Solution::Impl::Evaluate(std::span<const PatchPoint> points,
                                          bool radiosity) const {
  const PointsByCell by_cell(points, patch_counts.size());
  std::vector<Rgb> values(points.size());
  const std::span<const CellId> cells = by_cell.Cells();
  ForEachLoaded(cells, [&](size_t k, const LoadedCell& cell) {
    const std::span<const size_t> here = by_cell.Of(cells[k]);
    const size_t tasks = (here.size() + kPointsPerTask - 1) / kPointsPerTask;
    ParallelForInside(tasks, [&](size_t t) {
      const size_t to = std::min((t + 1) * kPointsPerTask, here.size());
      for (const size_t i :
           here.subspan(t * kPointsPerTask, to - t * kPointsPerTask)) {
        const PatchPoint& p = points[i];
        const Rgb value = NotBelowZero(IrradianceAt(cell, p.patch, {p.a, p.b}));
        values[i] = radiosity
                        ? RadiosityOf(cell.geometry.at(p.patch.Index()), value)
                        : value;
      }
    });
  });
  return values;
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
  return impl_->patch_counts.size();
}

uint64_t Solution::MostCellBytes() const {
  uint64_t most = 0;
  for (size_t i = 0; i < impl_->patch_counts.size(); ++i) {
    most = std::max(most, impl_->BytesOf(CellId(i)));
  }
  return most;
}

std::vector<Rgb> Solution::Irradiance(
    std::span<const PatchPoint> points) const {
  return impl_->Evaluate(points, false);
}

std::vector<Rgb> Solution::Radiosity(std::span<const PatchPoint> points) const {
  return impl_->Evaluate(points, true);
}

void Solution::ForEachLeaf(
    CellId cell, const std::function<void(const LeafElement&)>& visit) const {
  const LoadedCell loaded = impl_->Load(cell);
  for (size_t i = 0; i < loaded.tree->Size(); ++i) {
    const Element& e = loaded.tree->At(ElementId(i));
    if (e.first_child != 0) {
      continue;
    }
    const Patch& patch = loaded.stored.patches[e.patch];
    const bool triangle = patch.shape == PatchShape::kTriangle;
    const std::array<UnitPoint, 4> square = {{{0, 0}, {1, 0}, {1, 1}, {0, 1}}};
    const std::array<UnitPoint, 3> corners = {{{0, 0}, {1, 0}, {0, 1}}};
    LeafElement leaf;
    leaf.patch = PatchId(e.patch);
    for (size_t k = 0; k < (triangle ? 3U : 4U); ++k) {
      const UnitPoint at = triangle ? corners[k] : square[k];
      const double a = static_cast<double>(e.frame.a) +
                       static_cast<double>(e.frame.scale) * at.a;
      const double b = static_cast<double>(e.frame.b) +
                       static_cast<double>(e.frame.scale) * at.b;
      leaf.corners.push_back(patch.origin + patch.u * a + patch.v * b);
      // A hair inside, so that the corner's own leaf is read.
      const double middle = triangle ? 1.0 / 3 : 0.5;
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
  Cell(*impl_, impl_->Load(cell)).ForEachMean(patches, visit);
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
  const LoadedCell loaded = impl_->Load(cell);
  const DisplayCell display(
      *loaded.tree, loaded.gathered, loaded.stored.patches, *impl_->budget);
  for (size_t g = 0; g < display.GroupCount(); ++g) {
    visit(*display.Make(g, options), display.FirstOf(g));
  }
}

std::string Solution::Digest() const {
  uint64_t digest = 0;
  for (size_t i = 0; i < impl_->patch_counts.size(); ++i) {
    const LoadedCell cell = impl_->Load(CellId(i));
    const uint64_t tree = cell.tree->Digest(cell.gathered);
    digest = HashBytes(std::as_bytes(std::span(&tree, 1)), digest);
  }
  return HexDigits(digest);
}

}  // namespace enfilade
