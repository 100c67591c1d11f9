#include "partition/overlap_pairs.h"

#include "partition/overlap.h"
#include "partition/patch_cutter.h"

#include <algorithm>
#include <numeric>
#include <optional>
#include <tuple>
#include <utility>

namespace enfilade {
namespace {

bool LiesIn(const Polygon& polygon, const Plane& plane) {
  return Classify(polygon, plane, kCoincidentM) == PlaneSide::kOn;
}

Box3 BoxAround(const Polygon& polygon) {
  return Grown(BoundsOf(polygon), kCoincidentM);
}

// The pair of `own`, which lies in `plane`, and `patch`, without their numbers;
// nullopt if the two are not a pair. `own` is the front.
std::optional<OverlapPair> PairOn(const Polygon& own,
                                  const Plane& plane,
                                  const Patch& patch) {
  if (Dot(PatchNormal(patch), plane.normal) < kLeastFacing) {
    return std::nullopt;
  }
  const Polygon other = PolygonOf(patch);
  const Plane others = PlaneOf(other);
  if (!LiesIn(other, plane) && !LiesIn(own, others)) {
    return std::nullopt;
  }
  const Polygon overlap = OverlapOf(own, other, plane.normal);
  if (overlap.empty()) {
    return std::nullopt;
  }
  OverlapPair pair;
  pair.area_m2 = PolygonArea(overlap);
  pair.least_rise = pair.most_rise = others.Distance(overlap.front());
  for (const Point3 p : overlap) {
    const double rise = others.Distance(p);
    pair.least_rise = std::min(pair.least_rise, rise);
    pair.most_rise = std::max(pair.most_rise, rise);
  }
  return pair;
}

}  // namespace

Polygon OverlapOf(const Polygon& polygon, const Polygon& other, Vec3 normal) {
  Polygon rest = polygon;
  for (size_t i = 0; i < other.size() && !rest.empty(); ++i) {
    Plane side = EdgePlane(other[i], other[(i + 1) % other.size()], normal);
    side.offset += kNarrowM;
    rest = ClipToFront(rest, side, kRoundingM);
  }
  return rest.size() >= 3 && PolygonArea(rest) > kSmallM2 ? rest : Polygon{};
}

double OverlapArea(const Polygon& polygon, const Polygon& other, Vec3 normal) {
  const Polygon overlap = OverlapOf(polygon, other, normal);
  return overlap.empty() ? 0 : PolygonArea(overlap);
}

void OverlapPair::Swap() {
  std::swap(front, behind);
  std::swap(least_rise, most_rise);
  least_rise = -least_rise;
  most_rise = -most_rise;
}

// Measures from the patch with the higher number, whichever of the two is in
// front.
std::optional<OverlapPair> PairOf(uint32_t front,
                                  uint32_t behind,
                                  std::span<const Patch> patches) {
  const uint32_t first = std::max(front, behind);
  const Polygon own = PolygonOf(patches[first]);
  auto pair = PairOn(own, PlaneOf(own), patches[std::min(front, behind)]);
  if (pair) {
    pair->front = first;
    pair->behind = std::min(front, behind);
    if (first != front) {
      pair->Swap();
    }
  }
  return pair;
}

BoxTree TreeOf(std::span<const Patch> patches) {
  std::vector<Box3> boxes;
  boxes.reserve(patches.size());
  for (const Patch& p : patches) {
    boxes.push_back(BoxAround(PolygonOf(p)));
  }
  return BoxTree(std::move(boxes));
}

std::vector<uint32_t> RanksFromBack(std::span<const Patch> patches,
                                    std::span<const SurfaceRank> surfaces) {
  const auto key = [&](uint32_t i) {
    const Patch& p = patches[i];
    return std::tuple(p.is_enclosed,
                      p.emits,
                      -static_cast<int64_t>(surfaces[i].anywhere),
                      p.face.value,
                      i);
  };
  std::vector<uint32_t> order(patches.size());
  std::iota(order.begin(), order.end(), 0U);
  std::sort(order.begin(), order.end(), [&](uint32_t a, uint32_t b) {
    return key(a) < key(b);
  });
  std::vector<uint32_t> ranks(order.size());
  for (uint32_t i = 0; i < order.size(); ++i) {
    ranks[order[i]] = i;
  }
  return ranks;
}

}  // namespace enfilade
