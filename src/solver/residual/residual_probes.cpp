#include "solver/residual/residual_probes.h"

#include "base/check.h"
#include "base/random.h"
#include "base/stop.h"
#include "visibility/ray_tracer.h"
#include "visibility/visible_set.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numeric>
#include <optional>

namespace enfilade {
namespace {

// The density of points is the reflected radiosity plus one of these shares of
// its mean, the first on sides that light may reach, the second on others.
constexpr double kOpenShare = 0.15;
constexpr double kEnclosedShare = 0.01;
// Cells that are weighed together; bounds the memory that they take beside the
// weights.
constexpr size_t kCellsAtATime = 16;

}  // namespace

double EvenlySpread(size_t k, int power, double shift) {
  constexpr double kStep = 0.7548776662466927;  // 1 over the plastic number
  const double x =
      static_cast<double>(k) * (power == 1 ? kStep : kStep * kStep) + shift;
  return x - std::floor(x);
}

ProbeChooser::ProbeChooser(const BlockStorage& store,
                           std::span<const CellInfo> cells,
                           const Solution& solution,
                           double mean_reflected,
                           MemoryBudget& budget)
    : store_(&store),
      solution_(&solution),
      budget_(&budget),
      mean_reflected_(mean_reflected),
      charge_(budget,
              BytesFor(PatchCount(cells), cells.size()),
              "the weights of patches"),
      offset_(RayOffset(solution.Scene().bounds)) {
  Weigh(cells);
}

void ProbeChooser::Weigh(std::span<const CellInfo> infos) {
  std::vector<CellId> cells;
  uint32_t patches = 0;
  for (const CellInfo& cell : infos) {
    cells.emplace_back(cells.size());
    first_patch_.push_back(patches);
    patches += cell.patches;
  }
  first_patch_.push_back(patches);
  weights_.resize(patches + size_t{1});
  for (size_t first = 0; first < cells.size(); first += kCellsAtATime) {
    ThrowIfStopRequested();
    const size_t count = std::min(kCellsAtATime, cells.size() - first);
    WeighCells(std::span(cells).subspan(first, count));
  }
  std::partial_sum(weights_.begin(), weights_.end(), weights_.begin());
}

// Weighs some consecutive cells.
void ProbeChooser::WeighCells(std::span<const CellId> cells) {
  const uint32_t first = first_patch_[cells.front().Index()];
  const uint32_t count = first_patch_[cells.back().Index() + 1] - first;
  const MemoryCharge charge(
      *budget_, count * sizeof(double), "the areas of patches");
  std::vector<double> areas(count);  // 0 of patches that do not reflect
  std::vector<Light> lights(cells.size());
  solution_->VisitCells(cells, [&](size_t i, const SolvedCell& cell) {
    const std::span<const Patch> patches = cell.Patches();
    const uint32_t begin = first_patch_[cells[i].Index()];
    double* const weights = &weights_[begin + size_t{1}];
    cell.ForEachMean(
        FirstIds<PatchId>(patches.size()), [&](const LeafMean& leaf) {
          const size_t k = leaf.patch.Index();
          weights[k] += leaf.area * DensityOf(patches[k], leaf.irradiance);
          const double reflected = ReflectedOf(patches[k], leaf.irradiance);
          lights[i].sum += leaf.area * reflected;
          lights[i].square += leaf.area * reflected * reflected;
        });
    for (size_t k = 0; k < patches.size(); ++k) {
      const bool reflects = Reflects(patches[k], solution_->Scene().materials);
      areas[begin - first + k] = reflects ? PatchArea(patches[k]) : 0;
    }
  });
  area_ = std::accumulate(areas.begin(), areas.end(), area_);
  for (const Light& light : lights) {
    light_.sum += light.sum;
    light_.square += light.square;
  }
}

double ProbeChooser::LitShare() const {
  return light_.square > 0 ? light_.sum * light_.sum / (area_ * light_.square)
                           : 1;
}

// Mean of the channels, W/m2.
double ProbeChooser::ReflectedOf(const Patch& p, const Rgb& irradiance) const {
  if (!Reflects(p, solution_->Scene().materials)) {
    return 0;
  }
  const Rgb& rho =
      solution_->Scene().materials.at(p.material.Index()).reflectance;
  double reflected = 0;
  for (size_t c = 0; c < kRgbChannels; ++c) {
    reflected += rho[c] * std::abs(irradiance[c]) / kRgbChannels;
  }
  return reflected;
}

// The weight per area, W/m2.
double ProbeChooser::DensityOf(const Patch& p, const Rgb& irradiance) const {
  if (!Reflects(p, solution_->Scene().materials)) {
    return 0;
  }
  const double least = p.is_enclosed ? kEnclosedShare : kOpenShare;
  return ReflectedOf(p, irradiance) + least * mean_reflected_;
}

ProbeBatch ProbeChooser::Choose(uint64_t key, ProbeStrata strata) const {
  ProbeBatch batch;
  batch.probes.resize(strata.count);
  std::vector<ProbesInCell> in_cells;  // ascending, as the strata are
  for (uint32_t i = 0; i < strata.count; ++i) {
    ResidualProbe& probe = batch.probes[i];
    probe.key = MixKey(key, strata.first + i);
    Random random(probe.key);
    const double at =
        weights_.back() * (strata.first + i + random.Next()) / strata.all;
    const size_t patch = PatchAt(at);
    const auto of_cell = std::prev(
        std::upper_bound(first_patch_.begin(), first_patch_.end(), patch));
    const CellId cell(static_cast<size_t>(of_cell - first_patch_.begin()));
    if (in_cells.empty() || in_cells.back().cell != cell) {
      in_cells.push_back({cell, {}});
      AddVisible(cell, &batch);
    }
    probe.on = {cell, PatchId(patch - *of_cell), 0, 0};
    probe.visible = static_cast<uint32_t>(batch.visible.size() - 1);
    in_cells.back().places.push_back({i, probe.on.patch, at - weights_[patch]});
  }
  std::vector<CellId> cells;
  std::transform(in_cells.begin(),
                 in_cells.end(),
                 std::back_inserter(cells),
                 [](const ProbesInCell& in) { return in.cell; });
  solution_->VisitCells(cells, [&](size_t k, const SolvedCell& cell) {
    SetOnLeaves(cell, in_cells[k].places, &batch);
  });
  return batch;
}

void ProbeChooser::AddVisible(CellId cell, ProbeBatch* batch) const {
  batch->visible.push_back(LoadVisibleSources(*store_, cell));
  batch->charges.emplace_back(*budget_,
                              batch->visible.back().size() * sizeof(CellId),
                              "what a cell sees");
}

// Sets the points of a cell's probes on leaves. The places are in ascending
// order.
void ProbeChooser::SetOnLeaves(const SolvedCell& cell,
                               std::span<const Place> places,
                               ProbeBatch* batch) const {
  std::vector<PatchId> patches;
  for (const Place& place : places) {
    if (patches.empty() || patches.back() != place.patch) {
      patches.push_back(place.patch);
    }
  }
  auto next = places.begin();
  double along = 0;
  std::optional<LeafMean> last;  // last leaf of the patch with a weight
  const auto set_next = [&](const LeafMean& leaf) {
    SetOnLeaf(
        cell.Patches()[leaf.patch.Index()], leaf, &batch->probes[next->probe]);
    ++next;
  };
  // Sums of weights are rounded, so a place beyond the last leaf counts as on
  // it.
  const auto finish_patch = [&] {
    while (last && next != places.end() && next->patch == last->patch) {
      set_next(*last);
    }
    last.reset();
    along = 0;
  };
  cell.ForEachMean(patches, [&](const LeafMean& leaf) {
    if (last && last->patch != leaf.patch) {
      finish_patch();
    }
    const double density =
        DensityOf(cell.Patches()[leaf.patch.Index()], leaf.irradiance);
    if (!(density > 0)) {
      return;
    }
    last = leaf;
    along += leaf.area * density;
    while (next != places.end() && next->patch == leaf.patch &&
           next->along < along) {
      set_next(leaf);
    }
  });
  finish_patch();
  ENFILADE_CHECK(next == places.end(), "a probe lies on no leaf");
}

void ProbeChooser::SetOnLeaf(const Patch& patch,
                             const LeafMean& leaf,
                             ResidualProbe* probe) const {
  Random random(MixKey(probe->key, 2));
  const double s = random.Next();
  const auto [a, b] = FoldedOnto(patch.shape, s, random.Next());
  const auto scale = static_cast<double>(leaf.frame.scale);
  probe->patch = patch;
  probe->normal = PatchNormal(patch);
  probe->on.a = static_cast<double>(leaf.frame.a) + scale * a;
  probe->on.b = static_cast<double>(leaf.frame.b) + scale * b;
  probe->origin =
      PointOn(patch, probe->on.a, probe->on.b) + probe->normal * offset_;
  probe->weight = weights_.back() / DensityOf(patch, leaf.irradiance);
}

// The patch, counted over all cells, whose part of the line contains the place.
size_t ProbeChooser::PatchAt(double at) const {
  const auto it = std::upper_bound(weights_.begin(), weights_.end() - 1, at);
  size_t patch = static_cast<size_t>(it - weights_.begin()) - 1;
  while (patch > 0 && weights_[patch + 1] <= weights_[patch]) {
    --patch;  // the last patches may have no weight
  }
  return patch;
}

}  // namespace enfilade
