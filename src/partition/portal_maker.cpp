#include "partition/portal_maker.h"

#include "base/check.h"
#include "base/stop.h"

#include <algorithm>
#include <cstdint>
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
  uint32_t place = 0;  // in the order of all: that of the first of its parts
  uint32_t made = 0;   // after how many joins
  // Of those behind it, up to this place, it was tried in vain with what was
  // made after fewer joins than this.
  uint32_t tried_place = 0;
  uint32_t tried_joins = 0;

  // Whether the hull with one behind it is known to be too large.
  [[nodiscard]] bool HasTried(const Opening2& later) const {
    return later.made < tried_joins && later.place <= tried_place;
  }
};

// Joins openings of one plane two by two, always the first two that can be, and
// makes no hull twice.
class OpeningJoiner {
 public:
  OpeningJoiner(const Vec3& normal, std::vector<Opening2>* openings)
      : normal_(normal), openings_(*openings) {
    for (uint32_t i = 0; i < openings_.size(); ++i) {
      openings_[i].place = i;
    }
  }

  void Run() {
    while (JoinOne()) {
      ++joins_;
    }
  }

 private:
  bool JoinOne() {
    for (size_t i = 0; i < openings_.size(); ++i) {
      ThrowIfStopRequested();
      const size_t end = std::min(openings_.size(), i + kMostOpeningsCompared);
      for (size_t j = i + 1; j < end; ++j) {
        if (!openings_[i].HasTried(openings_[j]) && Join(i, j)) {
          return true;
        }
      }
      openings_[i].tried_place = openings_[end - 1].place;
      openings_[i].tried_joins = joins_ + 1;
    }
    return false;
  }

  // Puts both in the place of the first, if their hull is hardly larger.
  bool Join(size_t i, size_t j) {
    const Opening2& first = openings_[i];
    const Opening2& second = openings_[j];
    std::vector<Point3> points = first.polygon;
    points.insert(points.end(), second.polygon.begin(), second.polygon.end());
    Polygon hull = ConvexHull(points, normal_);
    const double parts = first.area_m2 + second.area_m2;
    const double area = hull.empty() ? 0 : PolygonArea(hull);
    if (hull.empty() || area > parts * (1 + kHullExcess)) {
      return false;
    }
    openings_[i] = {.polygon = std::move(hull),
                    .area_m2 = std::max(area, parts),
                    .place = first.place,
                    .made = joins_ + 1};
    openings_.erase(openings_.begin() + static_cast<std::ptrdiff_t>(j));
    return true;
  }

  Vec3 normal_;
  std::vector<Opening2>& openings_;
  uint32_t joins_ = 0;
};

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
        of_pair.push_back(
            {.polygon = polygon, .area_m2 = PolygonArea(polygon)});
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
      OpeningJoiner(normal, &openings).Run();
      for (Opening2& opening : openings) {
        visit({cells.first, cells.second, std::move(opening.polygon)});
      }
    }
    first = end;
  }
}

}  // namespace enfilade
