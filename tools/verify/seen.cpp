#include "tools/verify/seen.h"

#include "base/random.h"
#include "base/stop.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "tools/verify/survey.h"

namespace enfilade {
namespace {

constexpr uint64_t kMostGroup = 8;    // cells of one batch of rays
constexpr size_t kMostSeen = 1024;    // lamps of a cell
constexpr size_t kTests = 16;         // rays from a cell to a lamp
constexpr size_t kTestedAtOnce = 48;  // lamps
constexpr uint64_t kSearchBytes =     // of a cell of a group
    (kTestedAtOnce * kTests + CellSurveyor::kMostPoints) * 192;

// The least share of a lamp, if the lamp is in the same cell and if it is in
// another one.
constexpr double kHiddenShare = 0.5 / kTests;
constexpr double kHiddenBeyondShare = 0.1 / kTests;

// A lamp within this many radii counts as seen.
constexpr float kNearRadii = 3;

// The share of choices that is left to the tree, which knows all emitters.
constexpr double kTreeShare = 0.15;

// Keeps the `count` candidates that promise most light, by the tree's bound at
// some of the points.
void KeepTheStrongest(const EmitterTree& tree,
                      std::span<const Receiver> points,
                      size_t count,
                      std::vector<uint32_t>& candidates) {
  if (candidates.size() <= count) {
    return;
  }
  std::vector<std::pair<double, uint32_t>> ranked;
  for (const uint32_t lamp : candidates) {
    double sum = 0;
    for (size_t i = 0; i < points.size(); i += 8) {
      sum += tree.LampImportance(
          tree.Lamps()[lamp], points[i].position, points[i].normal);
    }
    ranked.emplace_back(-sum, lamp);
  }
  std::sort(ranked.begin(), ranked.end());
  ranked.resize(count);
  candidates.clear();
  for (const auto& [rank, lamp] : ranked) {
    candidates.push_back(lamp);
  }
  std::sort(candidates.begin(), candidates.end());
}

// All lamps of the cells in the survey, or the `most` strongest. A cell that
// reflects nothing (the sky before a window) gets none, because no path asks
// for its list.
std::vector<uint32_t> FindCandidates(const EmitterTree& tree,
                                     const CellSurvey& survey,
                                     size_t most) {
  std::vector<uint32_t> candidates;
  if (survey.points.empty()) {
    return candidates;
  }
  for (const CellId cell : survey.cells) {
    tree.AppendLampsOfCell(cell, candidates);
  }
  std::sort(candidates.begin(), candidates.end());
  candidates.erase(std::unique(candidates.begin(), candidates.end()),
                   candidates.end());
  KeepTheStrongest(tree, survey.points, most, candidates);
  return candidates;
}

}  // namespace

uint64_t SeenEmitters::Learn(const BuildingView& view,
                             MemoryBudget& budget,
                             uint64_t max_bytes,
                             uint64_t key) {
  const size_t cells = view.partition->cells.size();
  const uint64_t group_cells =
      std::clamp<uint64_t>(max_bytes / 4 / kSearchBytes, 1, kMostGroup);
  const uint64_t search_bytes =
      group_cells * kSearchBytes + CellSurveyor::Bytes(view);
  const uint64_t shape_bytes = tree_->Lamps().size() * sizeof(LampShape);
  const uint64_t least_bytes =
      search_bytes + shape_bytes + CellLists<Seen>::LeastBytes(cells);
  if (tree_->Emitters().empty() || least_bytes > max_bytes) {
    return 0;
  }
  const MemoryCharge search_charge(
      budget, search_bytes, "looking for the light sources that cells see");
  shapes_charge_ = MemoryCharge(budget, shape_bytes, "the shapes of lamps");
  middle_ =
      view.scene->bounds.IsEmpty() ? Point3{} : view.scene->bounds.Center();
  shapes_.reserve(tree_->Lamps().size());
  for (const EmitterTree::Lamp& lamp : tree_->Lamps()) {
    shapes_.push_back(ShapeOf(lamp));
  }
  lists_.Reserve(budget,
                 cells,
                 std::min(max_bytes - search_bytes - shape_bytes,
                          CellLists<Seen>::MostBytes(cells, kMostSeen)),
                 "the light sources that cells see");
  const uint64_t rays = LearnCells(view, group_cells, key);
  lists_.Finish();
  return rays;
}

uint64_t SeenEmitters::LearnCells(const BuildingView& view,
                                  uint64_t group_cells,
                                  uint64_t key) {
  const size_t cells = view.partition->cells.size();
  const CellSurveyor surveyor(view);
  uint64_t rays = 0;
  for (size_t first = 0; first < cells; first += group_cells) {
    for (const CellSurvey& survey : surveyor.Survey(first, group_cells, key)) {
      rays += survey.points.size();
      // What a cell leaves is for the cells after it.
      const uint64_t share = lists_.Room() / (cells - survey.cell.Index());
      const std::vector<uint32_t> candidates =
          FindCandidates(*tree_, survey, std::min<uint64_t>(share, kMostSeen));
      const std::span<const uint32_t> all(candidates);
      for (size_t i = 0; i < all.size(); i += kTestedAtOnce) {
        ThrowIfStopRequested();
        rays += Test(view,
                     survey.cell,
                     survey.points,
                     all.subspan(i, std::min(kTestedAtOnce, all.size() - i)),
                     MixKey(survey.key, 2));
      }
      lists_.EndCell();
    }
  }
  return rays;
}

// Finds the share of each candidate and drops none: a shade may hide a bulb
// from everything outside the shade, and inside it nothing else matters.
uint64_t SeenEmitters::Test(const BuildingView& view,
                            CellId cell,
                            std::span<const Receiver> points,
                            std::span<const uint32_t> candidates,
                            uint64_t key) {
  const double offset = RayOffset(view.scene->bounds);
  std::vector<TraceRay> rays;
  std::vector<size_t> ends;
  for (const uint32_t candidate : candidates) {
    const EmitterTree::Lamp& lamp = tree_->Lamps()[candidate];
    Random random(MixKey(key, candidate));
    // More tries than tests: a point may lie behind the emitter.
    for (size_t i = 0, found = 0; i < 4 * kTests && found < kTests; ++i) {
      const Receiver& r =
          points[random.NextBelow(static_cast<uint32_t>(points.size()))];
      const Emitter& e =
          tree_->Emitters()[lamp.first + random.NextBelow(lamp.count)];
      const double s = random.Next();
      const Receiver y = PointOnEmitter(e, s, random.Next());
      const Point3 x = r.position + r.normal * offset;
      if (GeometryTerm(x, r.normal, y.position, y.normal) > 0) {
        rays.push_back({x, (y.position + y.normal * offset) - x, 1});
        ++found;
      }
    }
    ends.push_back(rays.size());
  }
  std::vector<TraceHit> hits(rays.size());
  view.trace(rays, hits);
  size_t i = 0;
  for (size_t k = 0; k < candidates.size(); ++k) {
    const size_t tested = ends[k] - i;
    size_t open = 0;
    for (; i < ends[k]; ++i) {
      open += hits[i].hit ? 0U : 1U;
    }
    const bool is_own = HasEmitterIn(cell, tree_->Lamps()[candidates[k]]);
    const double share = static_cast<double>(open) /
                         static_cast<double>(std::max<size_t>(tested, 1));
    lists_.Add({candidates[k],
                static_cast<float>(std::max(
                    share, is_own ? kHiddenShare : kHiddenBeyondShare))});
  }
  return rays.size();
}

bool SeenEmitters::HasEmitterIn(CellId cell,
                                const EmitterTree::Lamp& lamp) const {
  const auto emitters =
      std::span(tree_->Emitters()).subspan(lamp.first, lamp.count);
  return std::any_of(emitters.begin(), emitters.end(), [&](const Emitter& e) {
    return e.cell == cell;
  });
}

SeenEmitters::LampShape SeenEmitters::ShapeOf(
    const EmitterTree::Lamp& lamp) const {
  const Vec3 center = tree_->Center(lamp) - middle_;
  const auto floats = [](double x, double y, double z) {
    return std::array{
        static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)};
  };
  LampShape shape;
  shape.power = static_cast<float>(tree_->Power(lamp));
  // A little more than the sphere's radius, because the centre is rounded.
  shape.radius = static_cast<float>(1.01 * tree_->Radius(lamp) + 1e-3);
  shape.center = floats(center.x, center.y, center.z);
  if (lamp.count > 1) {
    shape.roundness = 1;
  } else {
    const Vec3 normal = tree_->Emitters()[lamp.first].normal;
    shape.normal = floats(normal.x, normal.y, normal.z);
  }
  return shape;
}

// The unnormalised weights of the entries of one list at one point, and their
// sum. The array is not cleared, because that would take longer than most
// lists.
// NOLINTNEXTLINE(cppcoreguidelines-pro-type-member-init)
struct SeenEmitters::Weights {
  std::array<float, kMostSeen> of;  // in the order of the list
  double sum = 0;

  // The probability of this lamp among those of the list.
  [[nodiscard]] double ShareOf(std::span<const Seen> list,
                               uint32_t lamp) const {
    for (size_t i = 0; i < list.size(); ++i) {
      if (list[i].lamp == lamp) {
        return of[i] / sum;
      }
    }
    return 0;
  }

  // The entry chosen by `s`, uniform in [0, 1), in proportion to the weights.
  // Sets `s` to a new number uniform in [0, 1).
  [[nodiscard]] size_t Choose(size_t count, double& s) const {
    double left = s * sum;
    size_t chosen = 0;
    double within = 0;
    for (size_t i = 0; i < count && left >= 0; ++i) {
      if (of[i] > 0) {
        chosen = i;
        within = left / of[i];
        left -= of[i];
      }
    }
    s = std::clamp(within, 0.0, 0x1.fffffffffffffp-1);
    return chosen;
  }
};

SeenEmitters::Weights SeenEmitters::WeightsAt(std::span<const Seen> list,
                                              Point3 x,
                                              Vec3 normal) const {
  const Vec3 place = x - middle_;
  const auto px = static_cast<float>(place.x);
  const auto py = static_cast<float>(place.y);
  const auto pz = static_cast<float>(place.z);
  const auto nx = static_cast<float>(normal.x);
  const auto ny = static_cast<float>(normal.y);
  const auto nz = static_cast<float>(normal.z);
  Weights weights;
  for (size_t i = 0; i < list.size(); ++i) {
    const LampShape& e = shapes_[list[i].lamp];
    const float dx = e.center[0] - px;
    const float dy = e.center[1] - py;
    const float dz = e.center[2] - pz;
    const float near_x = nx * dx + ny * dy + nz * dz + e.radius;
    const float d2 = std::max(dx * dx + dy * dy + dz * dz, e.radius * e.radius);
    const float near_e =
        e.radius + e.roundness * std::sqrt(d2) -
        (e.normal[0] * dx + e.normal[1] * dy + e.normal[2] * dz);
    const float near_share = kNearRadii * kNearRadii * e.radius * e.radius / d2;
    const float share = std::min(1.0F, std::max(list[i].share, near_share));
    weights.of[i] = share * e.power * std::max(0.0F, near_x) *
                    std::max(0.0F, near_e) / (d2 * d2);
  }
  for (size_t i = 0; i < list.size(); ++i) {
    weights.sum += weights.of[i];
  }
  return weights;
}

std::optional<EmitterTree::Choice> SeenEmitters::Choose(
    std::optional<CellId> at, Point3 x, Vec3 normal, double s) const {
  const std::span<const Seen> list = lists_.Of(at);
  const Weights weights = WeightsAt(list, x, normal);
  if (weights.sum <= 0) {
    return tree_->Choose(x, normal, s);
  }
  const auto index_of = [&](const EmitterTree::Choice& choice) {
    return static_cast<uint32_t>(choice.emitter - tree_->Emitters().data());
  };
  if (s < kTreeShare) {
    auto choice = tree_->Choose(x, normal, s / kTreeShare);
    if (choice) {
      choice->probability =
          kTreeShare * choice->probability +
          (1 - kTreeShare) *
              ListProbability(list, weights, index_of(*choice), x, normal);
    }
    return choice;
  }
  double rest = (s - kTreeShare) / (1 - kTreeShare);
  const size_t entry = weights.Choose(list.size(), rest);
  auto choice =
      tree_->ChooseIn(tree_->Lamps()[list[entry].lamp], x, normal, rest);
  if (choice) {
    choice->probability =
        kTreeShare * tree_->Probability(index_of(*choice), x, normal) +
        (1 - kTreeShare) * choice->probability * weights.of[entry] /
            weights.sum;
  }
  return choice;
}

// The probability of an emitter by the list alone.
double SeenEmitters::ListProbability(std::span<const Seen> list,
                                     const Weights& weights,
                                     uint32_t emitter,
                                     Point3 x,
                                     Vec3 normal) const {
  const uint32_t lamp = tree_->LampOf(emitter);
  const double share = weights.ShareOf(list, lamp);
  return share > 0 ? share * tree_->ProbabilityIn(
                                 tree_->Lamps()[lamp], emitter, x, normal)
                   : 0;
}

double SeenEmitters::Density(std::optional<CellId> at,
                             Point3 x,
                             Vec3 normal,
                             const PatchPoint& y) const {
  const std::optional<uint32_t> e = tree_->Find(y.cell, y.patch);
  if (!e) {
    return 0;
  }
  const double by_tree = tree_->Probability(*e, x, normal);
  const double area = tree_->Emitters()[*e].area;
  const std::span<const Seen> list = lists_.Of(at);
  const Weights weights = WeightsAt(list, x, normal);
  if (weights.sum <= 0) {
    return by_tree / area;
  }
  return (kTreeShare * by_tree +
          (1 - kTreeShare) * ListProbability(list, weights, *e, x, normal)) /
         area;
}

}  // namespace enfilade
