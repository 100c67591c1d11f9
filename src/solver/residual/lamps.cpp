#include "solver/residual/lamps.h"

#include "base/parallel.h"
#include "base/stop.h"
#include "partition/patch_points.h"

#include <algorithm>
#include <cmath>
#include <iterator>

namespace enfilade {
namespace {

// A rough bound, up to a constant factor, of what a lamp sends to x; 0 if the
// lamp is behind x or x is behind the lamp.
double Importance(const Lamp& lamp, Point3 x, Vec3 normal) {
  const Patch& p = lamp.patch;
  double highest = 0;  // of the lamp's corners above x
  const CornerList<Point3> corners = CornersOf(p);
  for (const Point3 corner : corners.View()) {
    highest = std::max(highest, Dot(corner - x, normal));
  }
  const double before = Dot(x - p.origin, lamp.normal);
  if (highest <= 0 || before <= 0) {
    return 0;
  }
  const Vec3 d = Centroid(p) - x;
  const double square = std::max(Dot(d, d), lamp.area);
  const double size = std::sqrt(lamp.area);
  const double facing =
      std::min(1.0, (before + 0.1 * size) / std::sqrt(square)) *
      std::min(1.0, (highest + 0.1 * size) / std::sqrt(square));
  return MaxChannel(lamp.exitance) * lamp.area * facing / square;
}

}  // namespace

Lamps::Lamps(const BlockStorage& store,
             const SceneInfo& scene,
             size_t cells,
             MemoryBudget& budget) {
  constexpr const char* kWhat = "the patches that emit";
  GrowingCharge growing(budget, kWhat);
  for (uint32_t i = 0; i < cells; ++i) {
    ThrowIfStopRequested();
    const CellPatches cell = LoadCellPatches(store, CellId(i));
    const auto emitting = std::count_if(cell.patches.begin(),
                                        cell.patches.end(),
                                        [](const Patch& p) { return p.emits; });
    growing.GrowTo(BytesFor(lamps_.size() + static_cast<size_t>(emitting)));
    for (size_t k = 0; k < cell.patches.size(); ++k) {
      const Patch& p = cell.patches[k];
      if (p.emits) {
        lamps_.push_back({CellId(i),
                          PatchId(k),
                          p,
                          PatchNormal(p),
                          PatchArea(p),
                          scene.materials.at(p.material.Index()).exitance});
      }
    }
  }
  lamps_.shrink_to_fit();
  growing.ShrinkTo(0);
  charge_ =
      MemoryCharge(budget,
                   lamps_.size() * (sizeof(Lamp) +
                                    MostThreads() * LampChoice::kBytesPerLamp),
                   kWhat);
}

std::span<const Lamp> Lamps::Of(CellId cell) const {
  const auto [first, last] = std::equal_range(
      lamps_.begin(),
      lamps_.end(),
      Lamp{cell, {}, {}, {}, 0, {}},
      [](const Lamp& a, const Lamp& b) { return a.cell < b.cell; });
  return {first, last};
}

const Lamp* Lamps::Find(CellId cell, PatchId patch) const {
  const std::span<const Lamp> of_cell = Of(cell);
  const auto it = std::lower_bound(
      of_cell.begin(), of_cell.end(), patch, [](const Lamp& lamp, PatchId id) {
        return lamp.id < id;
      });
  return it != of_cell.end() && it->id == patch ? &*it : nullptr;
}

LampChoice::LampChoice(const Lamps& lamps,
                       std::span<const CellId> cells,
                       Point3 x,
                       Vec3 normal) {
  size_t most = 0;
  for (const CellId cell : cells) {
    most += lamps.Of(cell).size();
  }
  entries_.reserve(most);
  double sum = 0;
  for (const CellId cell : cells) {
    for (const Lamp& lamp : lamps.Of(cell)) {
      const double importance = Importance(lamp, x, normal);
      if (importance > 0) {
        sum += importance;
        entries_.push_back({&lamp, sum});
      }
    }
  }
}

const Lamp& LampChoice::Choose(double s) const {
  const double at = s * entries_.back().sum;
  const auto it = std::upper_bound(
      entries_.begin(),
      entries_.end() - 1,
      at,
      [](double value, const Entry& e) { return value < e.sum; });
  return *it->lamp;
}

double LampChoice::Density(const Lamp& lamp) const {
  const auto it = std::lower_bound(
      entries_.begin(),
      entries_.end(),
      &lamp,
      [](const Entry& e, const Lamp* l) { return e.lamp < l; });
  if (it == entries_.end() || it->lamp != &lamp) {
    return 0;
  }
  const double below = it == entries_.begin() ? 0 : std::prev(it)->sum;
  return (it->sum - below) / entries_.back().sum / lamp.area;
}

}  // namespace enfilade
