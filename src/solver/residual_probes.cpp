#include "solver/residual_probes.h"

#include "base/random.h"
#include "visibility/visible_set.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <tuple>

namespace enfilade {
namespace {

// Points are as dense as the reflected radiosity and these shares of its mean,
// on sides that light may and may not reach.
constexpr double kOpenShare = 0.15;
constexpr double kEnclosedShare = 0.01;
// So many points of a cell's patches say how much they reflect.
constexpr double kWeighingPointsPerCell = 1024;

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
      area_ += p.reflects ? PatchArea(p) : 0;
    }
  }
}

// By a few points of every patch, more of the large ones of the cell.
std::vector<double> ProbeChooser::WeightsOf(CellId id,
                                            const CellPatches& cell) const {
  double area = 0;
  for (const Patch& p : cell.patches) {
    area += PatchArea(p);
  }
  std::vector<PatchPoint> points;
  std::vector<size_t> ends;
  for (size_t k = 0; k < cell.patches.size(); ++k) {
    const double share = PatchArea(cell.patches[k]) / area;
    const auto count = 1 + static_cast<size_t>(kWeighingPointsPerCell * share);
    for (size_t i = 0; i < count; ++i) {
      const auto [a, b] =
          UniformOn(cell.patches[k],
                    (static_cast<double>(i) + 0.5) / static_cast<double>(count),
                    EvenlySpread(i, 1, 0.4));
      points.push_back({id, PatchId(k), a, b});
    }
    ends.push_back(points.size());
  }
  const std::vector<Rgb> irradiance = solution_->Irradiance(points);
  std::vector<double> weights(ends.size());
  size_t at = 0;
  for (size_t k = 0; k < ends.size(); ++k) {
    const auto count = static_cast<double>(ends[k] - at);
    for (; at < ends[k]; ++at) {
      weights[k] += WeightOf(cell.patches[k], irradiance[at]) / count;
    }
  }
  return weights;
}

double ProbeChooser::WeightOf(const Patch& p, const Rgb& irradiance) const {
  if (!p.reflects) {
    return 0;
  }
  const Rgb& rho =
      solution_->Scene().materials.at(p.material.Index()).reflectance;
  double reflected = 0;
  for (size_t c = 0; c < kRgbChannels; ++c) {
    reflected += rho[c] * std::abs(irradiance[c]) / kRgbChannels;
  }
  const double least = p.is_enclosed ? kEnclosedShare : kOpenShare;
  return MaxChannel(rho) > 0
             ? PatchArea(p) * (reflected + least * mean_reflected_)
             : 0;
}

ProbeBatch ProbeChooser::Choose(uint64_t key, ProbeStrata strata) const {
  ProbeBatch batch;
  std::optional<CellId> loaded;
  CellPatches cell;
  for (uint32_t i = strata.first; i < strata.first + strata.count; ++i) {
    Probe probe;
    probe.key = MixKey(key, i);
    Random random(probe.key);
    const double at = weights_.back() * (i + random.Next()) / strata.all;
    const size_t patch = PatchAt(at);
    const auto of_cell = std::prev(
        std::upper_bound(first_patch_.begin(), first_patch_.end(), patch));
    probe.on.cell = CellId(static_cast<size_t>(of_cell - first_patch_.begin()));
    probe.on.patch = PatchId(patch - *of_cell);
    if (loaded != probe.on.cell) {
      loaded = probe.on.cell;
      cell = LoadCellPatches(*store_, probe.on.cell);
      batch.visible.emplace_back();
      for (const VisibleCell& v : LoadVisibleSet(*store_, probe.on.cell)) {
        batch.visible.back().push_back(v.source);
      }
    }
    probe.visible = static_cast<uint32_t>(batch.visible.size() - 1);
    probe.patch = cell.patches[probe.on.patch.Index()];
    probe.normal = PatchNormal(probe.patch);
    const double s = random.Next();
    std::tie(probe.on.a, probe.on.b) = UniformOn(probe.patch, s, random.Next());
    probe.origin =
        PointAt(probe.patch, probe.on.a, probe.on.b) + probe.normal * offset_;
    const double density =
        (weights_[patch + 1] - weights_[patch]) / PatchArea(probe.patch);
    probe.weight = weights_.back() / density;
    batch.probes.push_back(probe);
  }
  return batch;
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
