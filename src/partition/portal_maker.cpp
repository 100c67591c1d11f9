#include "partition/portal_maker.h"

#include "base/check.h"

#include <algorithm>
#include <map>
#include <span>
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

// The openings of one node, by the cells in front and behind.
using NodeOpenings = std::map<std::pair<CellId, CellId>, std::vector<Opening2>>;

NodeOpenings OpeningsOf(std::span<const LeafBorder> borders,
                        const std::vector<CellId>& cell_of_leaf) {
  NodeOpenings openings;
  for (const LeafBorder& border : borders) {
    const CellId front = cell_of_leaf[border.front.Index()];
    const CellId back = cell_of_leaf[border.back.Index()];
    if (front != back) {
      auto& of_pair = openings[{front, back}];
      for (const Polygon& polygon : border.open) {
        of_pair.push_back({polygon, PolygonArea(polygon)});
      }
    }
  }
  return openings;
}

}  // namespace

void ForEachPortal(const BspTree& tree,
                   const std::vector<LeafBorder>& borders,
                   const std::vector<CellId>& cell_of_leaf,
                   const std::function<void(Portal)>& visit) {
  for (size_t first = 0; first < borders.size();) {
    const NodeId node = borders[first].node;
    size_t end = first;
    while (end < borders.size() && borders[end].node == node) {
      ++end;
    }
    ENFILADE_CHECK(end == borders.size() || node < borders[end].node,
                   "borders come in the order of their nodes");
    const Vec3& normal = tree.nodes[node.Index()].plane.normal;
    for (auto& [cells, openings] : OpeningsOf(
             std::span(borders).subspan(first, end - first), cell_of_leaf)) {
      while (JoinOne(normal, openings)) {
      }
      for (Opening2& opening : openings) {
        visit({cells.first, cells.second, std::move(opening.polygon)});
      }
    }
    first = end;
  }
}

}  // namespace enfilade
