#include "solver/residual/residual_probes.h"

#include "base/check.h"
#include "base/random.h"
#include "visibility/visible_set.h"

#include <algorithm>
#include <cmath>
#include <optional>

namespace enfilade {
namespace {

// Points are as dense as the reflected radiosity and these shares of its mean,
// on sides that light may and may not reach.
constexpr double kOpenShare = 0.15;
constexpr double kEnclosedShare = 0.01;

uint64_t WeightBytes(const Partition& partition) {
  uint64_t patches = 1;
  for (const CellInfo& cell : partition.cells) {
    patches += cell.patches;
  }
  return patches * sizeof(double);
}

}  // namespace

Point3 PointAt(const Patch& p, double a, double b) {
  return p.origin + p.u * a + p.v * b;
}

std::pair<double, double> UniformOn(const Patch& p, double s, double t) {
  const bool fold = p.shape == PatchShape::kTriangle && s + t > 1;
  return fold ? std::pair(1 - s, 1 - t) : std::pair(s, t);
}

double EvenlySpread(size_t k, int power, double shift) {
  constexpr double kStep = 0.7548776662466927;  // 1 over the plastic number
  const double x =
      static_cast<double>(k) * (power == 1 ? kStep : kStep * kStep) + shift;
  return x - std::floor(x);
}

ProbeChooser::ProbeChooser(const BlockStorage& store,
                           const Partition& partition,
                           const Solution& solution,
                           double mean_reflected,
                           MemoryBudget& budget)
    : store_(&store),
      solution_(&solution),
      budget_(&budget),
      mean_reflected_(mean_reflected),
      charge_(budget, WeightBytes(partition), "the weights of patches") {
  const Box3& bounds = solution.Scene().bounds;
  offset_ = std::max(1e-5, 1e-6 * Length(bounds.Extent()));
  weights_.reserve(WeightBytes(partition) / sizeof(double));
  weights_.push_back(0);
  for (uint32_t i = 0; i < partition.cells.size(); ++i) {
    const CellPatches cell = LoadCellPatches(store, CellId(i));
    first_patch_.push_back(static_cast<uint32_t>(weights_.size() - 1));
    for (const double weight : WeightsOf(CellId(i), cell)) {
      weights_.push_back(weights_.back() + weight);
    }
    for (const Patch& p : cell.patches) {
      area_ += Reflects(p, solution.Scene().materials) ? PatchArea(p) : 0;
    }
  }
}

std::vector<double> ProbeChooser::WeightsOf(CellId id,
                                            const CellPatches& cell) const {
  std::vector<PatchId> patches;
  for (size_t k = 0; k < cell.patches.size(); ++k) {
    patches.emplace_back(k);
  }
  std::vector<double> weights(patches.size());
  solution_->ForEachMean(id, patches, [&](const LeafMean& leaf) {
    const size_t k = leaf.patch.Index();
    weights[k] += leaf.area * DensityOf(cell.patches[k], leaf.irradiance);
  });
  return weights;
}

// Of the weight, W/m2.
double ProbeChooser::DensityOf(const Patch& p, const Rgb& irradiance) const {
  if (!Reflects(p, solution_->Scene().materials)) {
    return 0;
  }
  const Rgb& rho =
      solution_->Scene().materials.at(p.material.Index()).reflectance;
  double reflected = 0;
  for (size_t c = 0; c < kRgbChannels; ++c) {
    reflected += rho[c] * std::abs(irradiance[c]) / kRgbChannels;
  }
  const double least = p.is_enclosed ? kEnclosedShare : kOpenShare;
  return reflected + least * mean_reflected_;
}

ProbeBatch ProbeChooser::Choose(uint64_t key, ProbeStrata strata) const {
  ProbeBatch batch;
  batch.probes.resize(strata.count);
  std::vector<Place> places;  // of the probes of one cell
  std::optional<CellId> cell;
  for (uint32_t i = 0; i < strata.count; ++i) {
    ResidualProbe& probe = batch.probes[i];
    probe.key = MixKey(key, strata.first + i);
    Random random(probe.key);
    const double at =
        weights_.back() * (strata.first + i + random.Next()) / strata.all;
    const size_t patch = PatchAt(at);
    const auto of_cell = std::prev(
        std::upper_bound(first_patch_.begin(), first_patch_.end(), patch));
    probe.on.cell = CellId(static_cast<size_t>(of_cell - first_patch_.begin()));
    if (cell && *cell != probe.on.cell) {
      SetOnLeaves(*cell, places, &batch);
      places.clear();
    }
    cell = probe.on.cell;
    places.push_back({i, PatchId(patch - *of_cell), at - weights_[patch]});
  }
  if (cell) {
    SetOnLeaves(*cell, places, &batch);
  }
  return batch;
}

// Finishes the probes of a cell, whose places come in ascending order.
void ProbeChooser::SetOnLeaves(CellId cell,
                               std::span<const Place> places,
                               ProbeBatch* batch) const {
  const CellPatches stored = LoadCellPatches(*store_, cell);
  batch->visible.emplace_back();
  MemoryCharge charge;
  const auto reserve = [&](uint64_t bytes) {
    charge = MemoryCharge(*budget_, bytes, "what a cell sees");
  };
  for (const VisibleCell& v : LoadVisibleSet(*store_, cell, reserve)) {
    batch->visible.back().push_back(v.source);
  }
  std::vector<PatchId> patches;
  for (const Place& place : places) {
    ResidualProbe& probe = batch->probes[place.probe];
    probe.visible = static_cast<uint32_t>(batch->visible.size() - 1);
    probe.patch = stored.patches[place.patch.Index()];
    probe.normal = PatchNormal(probe.patch);
    probe.on.patch = place.patch;
    if (patches.empty() || patches.back() != place.patch) {
      patches.push_back(place.patch);
    }
  }
  auto next = places.begin();
  double along = 0;
  std::optional<LeafMean> last;  // of the patch, with a weight
  // Sums of weights are rounded: what lies beyond the last leaf lies on it.
  const auto finish_patch = [&] {
    for (; last && next != places.end() && next->patch == last->patch; ++next) {
      SetOnLeaf(*last, &batch->probes[next->probe]);
    }
    last.reset();
    along = 0;
  };
  solution_->ForEachMean(cell, patches, [&](const LeafMean& leaf) {
    if (last && last->patch != leaf.patch) {
      finish_patch();
    }
    const double density =
        DensityOf(stored.patches[leaf.patch.Index()], leaf.irradiance);
    if (!(density > 0)) {
      return;
    }
    last = leaf;
    along += leaf.area * density;
    for (; next != places.end() && next->patch == leaf.patch &&
           next->along < along;
         ++next) {
      SetOnLeaf(leaf, &batch->probes[next->probe]);
    }
  });
  finish_patch();
  ENFILADE_CHECK(next == places.end(), "a probe lies on no leaf");
}

void ProbeChooser::SetOnLeaf(const LeafMean& leaf, ResidualProbe* probe) const {
  Random random(MixKey(probe->key, 2));
  const double s = random.Next();
  const auto [a, b] = UniformOn(probe->patch, s, random.Next());
  const auto scale = static_cast<double>(leaf.frame.scale);
  probe->on.a = static_cast<double>(leaf.frame.a) + scale * a;
  probe->on.b = static_cast<double>(leaf.frame.b) + scale * b;
  probe->origin =
      PointAt(probe->patch, probe->on.a, probe->on.b) + probe->normal * offset_;
  probe->weight = weights_.back() / DensityOf(probe->patch, leaf.irradiance);
}

// The patch, counted over all cells, on whose part of the line a place is.
size_t ProbeChooser::PatchAt(double at) const {
  const auto it = std::upper_bound(weights_.begin(), weights_.end() - 1, at);
  size_t patch = static_cast<size_t>(it - weights_.begin()) - 1;
  while (patch > 0 && weights_[patch + 1] <= weights_[patch]) {
    --patch;  // the last ones have no weight
  }
  return patch;
}

}  // namespace enfilade
