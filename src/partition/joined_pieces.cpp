#include "partition/joined_pieces.h"

#include "base/disjoint_sets.h"
#include "base/stop.h"
#include "scene/box_tree.h"

#include <algorithm>
#include <cstdint>
#include <vector>

namespace enfilade {
namespace {

// Whether a strip wider than gap_m, parallel to an edge of `a`, separates the
// two.
bool IsApartAlongEdges(const Polygon& a,
                       const Polygon& b,
                       const Vec3& normal,
                       double gap_m) {
  for (size_t i = 0; i < a.size(); ++i) {
    const Vec3 aside = Cross(a[(i + 1) % a.size()] - a[i], normal);
    if (Length(aside) < kRoundingM) {
      continue;
    }
    const Vec3 across = Normalize(aside);
    const AxisRange of_a = RangeAlong(a, across);
    const AxisRange of_b = RangeAlong(b, across);
    if (of_a.low > of_b.high + gap_m || of_b.low > of_a.high + gap_m) {
      return true;
    }
  }
  return false;
}

// The direction of the longest edge of the largest polygon, as most floors are
// drawn along one direction. In a building that is turned, boxes along the axes
// of the world would all overlap.
Vec3 MainDirection(std::span<const Polygon> polygons) {
  const Polygon& largest = *std::max_element(
      polygons.begin(), polygons.end(), [](const Polygon& a, const Polygon& b) {
        return PolygonArea(a) < PolygonArea(b);
      });
  Vec3 longest{1, 0, 0};
  double most = 0;
  for (size_t i = 0; i < largest.size(); ++i) {
    const Vec3 edge = largest[(i + 1) % largest.size()] - largest[i];
    if (Length(edge) > most) {
      most = Length(edge);
      longest = edge / most;
    }
  }
  return longest;
}

std::vector<Box3> BoxesInPlane(std::span<const Polygon> polygons,
                               const Vec3& normal) {
  const Vec3 u = MainDirection(polygons);
  const Vec3 v = Cross(normal, u);
  std::vector<Box3> boxes;
  boxes.reserve(polygons.size());
  for (const Polygon& polygon : polygons) {
    const AxisRange along = RangeAlong(polygon, u);
    const AxisRange aside = RangeAlong(polygon, v);
    boxes.push_back({{along.low, aside.low, 0}, {along.high, aside.high, 0}});
  }
  return boxes;
}

}  // namespace

double AreaOfLargePieces(std::span<const Polygon> polygons,
                         const Vec3& normal,
                         double gap_m,
                         double least_m2) {
  if (polygons.empty()) {
    return 0;
  }
  const std::vector<Box3> boxes = BoxesInPlane(polygons, normal);
  const BoxTree tree(boxes);
  DisjointSets pieces(polygons.size());
  for (uint32_t i = 0; i < polygons.size(); ++i) {
    ThrowIfStopRequested();
    tree.ForOverlaps(Grown(boxes[i], gap_m), [&](uint32_t k) {
      if (k < i && pieces.Find(i) != pieces.Find(k) &&
          !IsApartAlongEdges(polygons[i], polygons[k], normal, gap_m) &&
          !IsApartAlongEdges(polygons[k], polygons[i], normal, gap_m)) {
        pieces.Join(i, k);
      }
    });
  }
  std::vector<double> area_m2(polygons.size());
  for (uint32_t i = 0; i < polygons.size(); ++i) {
    area_m2[pieces.Find(i)] += PolygonArea(polygons[i]);
  }
  double large_m2 = 0;
  for (const double m2 : area_m2) {
    large_m2 += m2 >= least_m2 ? m2 : 0;
  }
  return large_m2;
}

}  // namespace enfilade
