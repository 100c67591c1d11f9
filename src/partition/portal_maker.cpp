#include "partition/portal_maker.h"

#include <algorithm>
#include <map>
#include <tuple>
#include <utility>

namespace enfilade {
namespace {

// A hull may exceed its parts by this share.
constexpr double kHullExcess = 0.01;
// More openings than this in one plane between two cells are not compared all
// with all.
constexpr size_t kMostOpeningsCompared = 64;

struct Opening2 {
  Polygon polygon;
  double area_m2 = 0;
};

bool JoinOne(const Vec3& normal, std::vector<Opening2>& openings) {
  for (size_t i = 0; i < openings.size(); ++i) {
    const size_t end = std::min(openings.size(), i + kMostOpeningsCompared);
    for (size_t j = i + 1; j < end; ++j) {
      std::vector<Point3> points = openings[i].polygon;
      points.insert(
          points.end(), openings[j].polygon.begin(), openings[j].polygon.end());
      Polygon hull = ConvexHull(points, normal);
      const double parts = openings[i].area_m2 + openings[j].area_m2;
      const double area = hull.empty() ? 0 : PolygonArea(hull);
      if (!hull.empty() && area <= parts * (1 + kHullExcess)) {
        openings[i] = {std::move(hull), std::max(area, parts)};
        openings.erase(openings.begin() + static_cast<std::ptrdiff_t>(j));
        return true;
      }
    }
  }
  return false;
}

}  // namespace

std::vector<Portal> MakePortals(const BspTree& tree,
                                const std::vector<LeafBorder>& borders,
                                const std::vector<CellId>& cell_of_leaf) {
  // By node and cells in front and behind.
  using Key = std::tuple<NodeId, CellId, CellId>;
  std::map<Key, std::vector<Opening2>> openings;
  for (const LeafBorder& border : borders) {
    const CellId front = cell_of_leaf[border.front.Index()];
    const CellId back = cell_of_leaf[border.back.Index()];
    if (front != back) {
      auto& of_pair = openings[{border.node, front, back}];
      for (const Polygon& polygon : border.open) {
        of_pair.push_back({polygon, PolygonArea(polygon)});
      }
    }
  }
  std::vector<Portal> portals;
  for (auto& [key, of_pair] : openings) {
    const Vec3& normal = tree.nodes[std::get<0>(key).Index()].plane.normal;
    while (JoinOne(normal, of_pair)) {
    }
    for (Opening2& opening : of_pair) {
      portals.push_back(
          {std::get<1>(key), std::get<2>(key), std::move(opening.polygon)});
    }
  }
  return portals;
}

}  // namespace enfilade
