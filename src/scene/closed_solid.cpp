#include "scene/closed_solid.h"

#include "base/disjoint_sets.h"
#include "base/photometry.h"
#include "base/planar_polygon.h"
#include "base/stop.h"
#include "base/winding_number.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

namespace enfilade {
namespace {

// The winding numbers of a solid take time quadratic in its polygons.
constexpr size_t kMostPolygons = 512;
constexpr double kRounding = 0.1;  // of a winding number
// Vertices this share of `beside` behind a polygon count as in its plane.
constexpr double kFlatShare = 0.25;
// A point near a corner is this share of the way to the middle.
constexpr double kNearCorner = 0.02;

double Side(Point3 from, Point3 to, Point3 p, Vec3 normal) {
  return Dot(Cross(to - from, p - from), normal);
}

// A corner of a polygon and its neighbours.
struct Corner {
  Point3 before, at, after;
  double area = 0;  // twice that of their triangle, negative if concave
};

Corner CornerAt(std::span<const Point3> polygon, size_t k, Vec3 normal) {
  const size_t n = polygon.size();
  const Point3 before = polygon[(k + n - 1) % n];
  const Point3 after = polygon[(k + 1) % n];
  return {before, polygon[k], after, Side(before, polygon[k], after, normal)};
}

// How much of a convex corner's triangle can be kept, as a factor of its sides
// from the corner, such that no vertex of the polygon lies in it. The triangle
// is then in the polygon, since an edge that crossed it would have to end in it
// or to cross the corner's own edges.
double FreeShare(std::span<const Point3> polygon, size_t k, Vec3 normal) {
  const Corner corner = CornerAt(polygon, k, normal);
  double share = 1;
  for (size_t i = 0; i < polygon.size(); ++i) {
    const Point3 p = polygon[i];
    if (i != k && Side(corner.before, corner.at, p, normal) >= 0 &&
        Side(corner.at, corner.after, p, normal) >= 0) {
      const double towards_corner =
          Side(corner.after, corner.before, p, normal) / corner.area;
      share = std::min(share, 1 - towards_corner);
    }
  }
  return share;
}

// A point strictly inside a simple polygon: the middle of the largest triangle
// that FreeShare leaves at a corner.
Point3 PointInside(std::span<const Point3> polygon, Vec3 normal) {
  std::vector<std::pair<double, size_t>> corners;  // by area, negated
  for (size_t k = 0; k < polygon.size(); ++k) {
    const double area = CornerAt(polygon, k, normal).area;
    if (area > 0) {
      corners.emplace_back(-area, k);
    }
  }
  std::sort(corners.begin(), corners.end());
  double largest = 0;
  Point3 inside = polygon[0];
  for (const auto& [negated, k] : corners) {
    if (-negated <= largest) {
      break;
    }
    ThrowIfStopRequested();
    const double share = FreeShare(polygon, k, normal);
    if (-negated * share * share > largest) {
      largest = -negated * share * share;
      const Corner c = CornerAt(polygon, k, normal);
      inside = c.at + ((c.before - c.at) + (c.after - c.at)) * (share / 3);
    }
  }
  return inside;
}

// A point beside a corner of the polygon: on the way to `middle`, a point
// inside, or on the line that halves the corner's angle, if that way begins
// outside or along an edge.
Point3 PointNearCorner(std::span<const Point3> polygon,
                       size_t k,
                       Point3 middle,
                       Vec3 normal) {
  constexpr double kAlongEdge = 1e-3;  // the sine of an angle
  const Corner c = CornerAt(polygon, k, normal);
  const Vec3 in = Normalize(c.at - c.before);
  const Vec3 out = Normalize(c.after - c.at);
  const Vec3 way = Normalize(middle - c.at);
  const double left_of_in = Dot(Cross(in, way), normal);
  const double left_of_out = Dot(Cross(out, way), normal);
  const double least = c.area > 0 ? std::min(left_of_in, left_of_out)
                                  : std::max(left_of_in, left_of_out);
  if (least > kAlongEdge) {
    return Lerp(c.at, middle, kNearCorner);
  }
  const double shorter =
      std::min(Length(c.at - c.before), Length(c.after - c.at));
  return c.at +
         (Cross(normal, in) + Cross(normal, out)) * (kNearCorner * shorter);
}

// A polygon that passes an edge, `up` if from the lower vertex number to the
// higher one.
struct EdgeUse {
  size_t polygon = 0;
  bool up = false;
};

class SolidFinder {
 public:
  SolidFinder(std::span<const Point3> vertices,
              std::span<const VertexLoop> polygons,
              double beside)
      : vertices_(vertices),
        polygons_(polygons),
        beside_(beside),
        sets_(polygons.size()),
        turned_(polygons.size()),
        found_{std::vector<std::optional<ClosedSolid>>(polygons.size()),
               std::vector<uint32_t>(polygons.size())} {}

  PolygonSolids Run() {
    FindEdges();
    for (const auto& [set, members] : WatertightSets()) {
      if (members.size() >= 4 && members.size() <= kMostPolygons) {
        Describe(members);
      }
    }
    return std::move(found_);
  }

 private:
  size_t SetOf(size_t polygon) {
    return sets_.Find(static_cast<uint32_t>(polygon));
  }

  void FindEdges() {
    for (size_t i = 0; i < polygons_.size(); ++i) {
      const VertexLoop& loop = polygons_[i];
      for (size_t k = 0; k < loop.size(); ++k) {
        const uint32_t a = loop[k];
        const uint32_t b = loop[(k + 1) % loop.size()];
        edges_[std::minmax(a, b)].push_back({i, a < b});
      }
    }
  }

  // The sets of polygons in which exactly two meet at every edge. Solids may
  // touch along an edge, which then has four polygons: the solids are told
  // apart by the edges with two polygons.
  [[nodiscard]] std::map<size_t, std::vector<size_t>> WatertightSets() {
    for (const auto& [ends, uses] : edges_) {
      if (uses.size() == 2) {
        sets_.Join(static_cast<uint32_t>(uses[0].polygon),
                   static_cast<uint32_t>(uses[1].polygon));
      }
    }
    std::vector<bool> leaks(polygons_.size());
    for (const auto& [ends, uses] : edges_) {
      for (const EdgeUse& use : uses) {
        const size_t set = SetOf(use.polygon);
        const auto here =
            std::count_if(uses.begin(), uses.end(), [&](const EdgeUse& other) {
              return SetOf(other.polygon) == set;
            });
        leaks[set] = leaks[set] || here != 2;
      }
    }
    std::map<size_t, std::vector<size_t>> members;
    for (size_t i = 0; i < polygons_.size(); ++i) {
      if (!leaks[SetOf(i)]) {
        members[SetOf(i)].push_back(i);
      }
    }
    return members;
  }

  // Records on which side of each polygon the inside is, if the side can be
  // found for all of them.
  void Describe(const std::vector<size_t>& members) {
    if (!Orient(members)) {
      return;
    }
    ClosedSolid solid;
    for (const size_t i : members) {
      for (const uint32_t v : polygons_[i]) {
        solid.bounds.Include(vertices_[v]);
      }
    }
    const auto fronts = FrontsOfConvex(members);
    const auto sides = fronts ? fronts : FrontsByWinding(members);
    if (!sides) {
      return;
    }
    ++count_;
    for (size_t k = 0; k < members.size(); ++k) {
      solid.front_is_inside = (*sides)[k];
      found_.solids[members[k]] = solid;
      found_.numbers[members[k]] = count_;
    }
  }

  // For each polygon whether the inside is at its front.
  using Fronts = std::vector<bool>;

  // nullopt unless all vertices lie on one side of each polygon.
  [[nodiscard]] std::optional<Fronts> FrontsOfConvex(
      const std::vector<size_t>& members) const {
    const double tolerance = kFlatShare * beside_;
    Fronts fronts;
    for (const size_t i : members) {
      ThrowIfStopRequested();
      const auto [middle, normal] = MiddleOf(polygons_[i]);
      double low = 0;
      double high = 0;
      for (const size_t k : members) {
        for (const uint32_t v : polygons_[k]) {
          const double height = Dot(vertices_[v] - middle, normal);
          low = std::min(low, height);
          high = std::max(high, height);
        }
      }
      const bool is_behind = high <= tolerance;
      if (is_behind == (low >= -tolerance)) {  // on both sides, or flat
        return std::nullopt;
      }
      fronts.push_back(!is_behind);
    }
    return fronts;
  }

  // nullopt unless the inside winds one way beside all polygons.
  [[nodiscard]] std::optional<Fronts> FrontsByWinding(
      const std::vector<size_t>& members) const {
    Fronts fronts;
    std::optional<int> winding;
    for (const size_t i : members) {
      ThrowIfStopRequested();
      const auto inside = InsideOf(members, i);
      if (!inside || inside->winding != winding.value_or(inside->winding)) {
        return std::nullopt;
      }
      winding = inside->winding;
      fronts.push_back(inside->is_front);
    }
    return fronts;
  }

  // Finds which polygons must be turned to agree with the first, since files
  // wind polygons arbitrarily. False if the polygons cannot all agree.
  bool Orient(const std::vector<size_t>& members) {
    std::vector<bool> known(polygons_.size());
    std::vector<size_t> open = {members.front()};
    known[members.front()] = true;
    while (!open.empty()) {
      const size_t i = open.back();
      open.pop_back();
      for (const Neighbour& next : NeighboursOf(i)) {
        if (!known[next.polygon]) {
          known[next.polygon] = true;
          turned_[next.polygon] = next.turned;
          open.push_back(next.polygon);
        } else if (turned_[next.polygon] != next.turned) {
          return false;
        }
      }
    }
    return true;
  }

  // A polygon across an edge, and whether it must be turned to agree.
  struct Neighbour {
    size_t polygon = 0;
    bool turned = false;
  };

  [[nodiscard]] std::vector<Neighbour> NeighboursOf(size_t i) {
    std::vector<Neighbour> neighbours;
    const VertexLoop& loop = polygons_[i];
    for (size_t k = 0; k < loop.size(); ++k) {
      const uint32_t a = loop[k];
      const uint32_t b = loop[(k + 1) % loop.size()];
      for (const EdgeUse& other : edges_.at(std::minmax(a, b))) {
        if (other.polygon != i && SetOf(other.polygon) == SetOf(i)) {
          // Polygons that agree pass their edge in opposite directions.
          neighbours.push_back(
              {other.polygon, turned_[i] != (other.up == (a < b))});
        }
      }
    }
    return neighbours;
  }

  // How often the polygons, turned to agree, wind around a point. Their fans
  // are walked in place: a list of triangles takes 72 bytes for each corner.
  [[nodiscard]] double WindingNumberAt(const std::vector<size_t>& members,
                                       Point3 p) const {
    double solid_angle = 0;
    for (const size_t i : members) {
      const VertexLoop& loop = polygons_[i];
      const Vec3 first = vertices_[loop[0]] - p;
      double of_polygon = 0;
      for (size_t k = 2; k < loop.size(); ++k) {
        of_polygon += SolidAngle(
            first, vertices_[loop[k - 1]] - p, vertices_[loop[k]] - p);
      }
      solid_angle += turned_[i] ? -of_polygon : of_polygon;
    }
    return solid_angle / (4 * kPi);
  }

  // The inside of the solid beside a polygon.
  struct Inside {
    bool is_front = false;
    int winding = 0;  // 1 or -1
  };

  static bool Is(double winding, int whole) {
    return std::abs(winding - whole) < kRounding;
  }

  // nullopt unless the inside is on exactly one side of polygon i, and all
  // along it. Where a solid crosses itself, what was its inside winds the other
  // way round.
  [[nodiscard]] std::optional<Inside> InsideOf(
      const std::vector<size_t>& members, size_t i) const {
    const auto [middle, normal] = MiddleOf(polygons_[i]);
    const double front = WindingNumberAt(members, middle + normal * beside_);
    const double back = WindingNumberAt(members, middle - normal * beside_);
    const bool is_front = Is(back, 0);
    const double inside = is_front ? front : back;
    if ((!is_front && !Is(front, 0)) || !(Is(inside, 1) || Is(inside, -1))) {
      return std::nullopt;
    }
    const int sign = inside > 0 ? 1 : -1;
    const Vec3 inwards = normal * (is_front ? beside_ : -beside_);
    const std::vector<Point3> corners = PointsOf(vertices_, polygons_[i]);
    for (size_t k = 0; k < corners.size(); ++k) {
      const Point3 near_corner = PointNearCorner(corners, k, middle, normal);
      const double there = WindingNumberAt(members, near_corner + inwards);
      // Where the solid is thinner than `beside`, that point is outside.
      if (!Is(there, sign) && !Is(there, 0)) {
        return std::nullopt;
      }
    }
    return Inside{is_front, sign};
  }

  // A point in the polygon, and the polygon's normal.
  [[nodiscard]] std::pair<Point3, Vec3> MiddleOf(const VertexLoop& loop) const {
    const std::vector<Point3> points = PointsOf(vertices_, loop);
    const Vec3 normal = Normalize(AreaVector(points));
    return {PointInside(points, normal), normal};
  }

  std::span<const Point3> vertices_;
  std::span<const VertexLoop> polygons_;
  double beside_;
  std::map<std::pair<uint32_t, uint32_t>, std::vector<EdgeUse>> edges_;
  DisjointSets sets_;         // of polygons that share edges
  std::vector<bool> turned_;  // by polygon, against the first of its set
  PolygonSolids found_;
  uint32_t count_ = 0;  // of solids
};

}  // namespace

PolygonSolids FindClosedSolids(std::span<const Point3> vertices,
                               std::span<const VertexLoop> polygons,
                               double beside) {
  return SolidFinder(vertices, polygons, beside).Run();
}

}  // namespace enfilade
