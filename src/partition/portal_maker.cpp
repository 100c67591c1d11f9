#include "partition/portal_maker.h"

#include "base/check.h"
#include "base/stop.h"

#include <algorithm>
#include <cstdint>
#include <map>
#include <optional>
#include <utility>

namespace enfilade {
namespace {

// The area of a hull may exceed that of its parts by this share.
constexpr double kHullExcess = 0.01;
// Each opening is compared only with those less than this many places after it
// in the same plane between the same two cells.
constexpr size_t kMostOpeningsCompared = 64;

struct Opening2 {
  Polygon polygon;
  double area_m2 = 0;
  // The place, in the original order, of the first opening in this one.
  uint32_t place = 0;
  // The number of joins after which this opening was made.
  uint32_t made = 0;
  // This opening was tried in vain with every later opening whose `place` is at
  // most tried_place and whose `made` is less than tried_joins.
  uint32_t tried_place = 0;
  uint32_t tried_joins = 0;

  // Whether the hull with a later opening is known to be too large.
  [[nodiscard]] bool HasTried(const Opening2& later) const {
    return later.made < tried_joins && later.place <= tried_place;
  }
};

// Joins openings of one plane two by two, always the first two that can be
// joined. Computes no hull twice.
class OpeningJoiner {
 public:
  OpeningJoiner(const Vec3& normal, std::vector<Opening2>* openings)
      : normal_(normal), openings_(*openings) {
    for (uint32_t i = 0; i < openings_.size(); ++i) {
      openings_[i].place = i;
    }
  }

  void Run() {
    size_t from = 0;
    while (const auto joined = JoinOne(from)) {
      ++joins_;
      // Openings before these are not compared with the one that was made.
      from = *joined - std::min(*joined, kMostOpeningsCompared - 1);
    }
  }

 private:
  // Joins the first two openings that can be, the first of them not before
  // `from`. Returns where the joined one is.
  std::optional<size_t> JoinOne(size_t from) {
    for (size_t i = from; i < openings_.size(); ++i) {
      ThrowIfStopRequested();
      const size_t end = std::min(openings_.size(), i + kMostOpeningsCompared);
      for (size_t j = i + 1; j < end; ++j) {
        if (!openings_[i].HasTried(openings_[j]) && Join(i, j)) {
          return i;
        }
      }
      openings_[i].tried_place = openings_[end - 1].place;
      openings_[i].tried_joins = joins_ + 1;
    }
    return std::nullopt;
  }

  // Replaces the first opening by the hull of both and removes the second, if
  // the hull is hardly larger than both.
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

// Takes openings in the order of their nodes, and makes the portals of one node
// after another.
class PortalMaker {
 public:
  PortalMaker(const BspTree& tree,
              const std::vector<CellId>& cell_of_leaf,
              const std::function<void(Portal)>& visit)
      : tree_(&tree), cell_of_leaf_(&cell_of_leaf), visit_(&visit) {}

  void Add(const LeafBorder& border, Polygon opening) {
    if (border.node != node_) {
      ENFILADE_CHECK(node_ < border.node,
                     "borders come in the order of their nodes");
      FinishNode();
      node_ = border.node;
    }
    const CellId front = (*cell_of_leaf_)[border.front.Index()];
    const CellId back = (*cell_of_leaf_)[border.back.Index()];
    if (front != back) {
      const double area_m2 = PolygonArea(opening);
      openings_[{front, back}].push_back(
          {.polygon = std::move(opening), .area_m2 = area_m2});
    }
  }

  void FinishNode() {
    for (auto& [cells, openings] : openings_) {
      OpeningJoiner(tree_->nodes[node_.Index()].plane.normal, &openings).Run();
      for (Opening2& opening : openings) {
        (*visit_)({cells.first, cells.second, std::move(opening.polygon)});
      }
    }
    openings_.clear();
  }

 private:
  const BspTree* tree_;
  const std::vector<CellId>* cell_of_leaf_;
  const std::function<void(Portal)>* visit_;
  NodeId node_{0U};
  NodeOpenings openings_;  // of node_
};

}  // namespace

void ForEachPortal(const BspTree& tree,
                   const OpenBorders& borders,
                   const std::vector<CellId>& cell_of_leaf,
                   const std::function<void(Portal)>& visit) {
  PortalMaker maker(tree, cell_of_leaf, visit);
  borders.ForEachOpening([&maker](const LeafBorder& border, Polygon opening) {
    maker.Add(border, std::move(opening));
  });
  maker.FinishNode();
}

}  // namespace enfilade
