#include "scene/region_join.h"

#include "base/planar_polygon.h"
#include "scene/figure_cut.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <tuple>
#include <unordered_map>

#include <OpenMesh/Core/Mesh/PolyMesh_ArrayKernelT.hh>
#include <OpenMesh/Core/System/omstream.hh>

namespace enfilade {
namespace {

// Neighbours whose normals differ by more are never joined, however near their
// vertices are to one plane.
constexpr double kLeastNormalDot = 0.99996;  // half a degree

// One side of one polygon, filed under its undirected edge.
struct PolygonSide {
  uint32_t low = 0, high = 0;
  uint32_t polygon = 0;
  bool forward = true;  // runs from low to high
};

std::vector<PolygonSide> SortedSides(const std::vector<VertexLoop>& polygons) {
  std::vector<PolygonSide> sides;
  for (uint32_t f = 0; f < polygons.size(); ++f) {
    const VertexLoop& loop = polygons[f];
    for (size_t i = 0; i < loop.size(); ++i) {
      const uint32_t a = loop[i];
      const uint32_t b = loop[(i + 1) % loop.size()];
      sides.push_back({std::min(a, b), std::max(a, b), f, a < b});
    }
  }
  std::sort(sides.begin(),
            sides.end(),
            [](const PolygonSide& a, const PolygonSide& b) {
              return std::tie(a.low, a.high, a.polygon) <
                     std::tie(b.low, b.high, b.polygon);
            });
  return sides;
}

// Grows regions, starting from the largest polygons.
class RegionFinder {
 public:
  RegionFinder(std::span<const Point3> vertices,
               std::vector<VertexLoop>& polygons,
               std::span<const uint32_t> kinds,
               const RegionTolerance& tolerance,
               bool oriented)
      : vertices_(vertices),
        polygons_(polygons),
        kinds_(kinds),
        tolerance_(tolerance),
        oriented_(oriented) {
    for (const VertexLoop& loop : polygons_) {
      areas_.push_back(AreaVector(PointsOf(vertices_, loop)));
    }
    FindNeighbours();
  }

  std::vector<std::vector<uint32_t>> Run() {
    std::vector<uint32_t> order(polygons_.size());
    std::iota(order.begin(), order.end(), 0U);
    std::stable_sort(order.begin(), order.end(), [&](uint32_t a, uint32_t b) {
      return Dot(areas_[a], areas_[a]) > Dot(areas_[b], areas_[b]);
    });
    taken_.assign(polygons_.size(), false);
    std::vector<std::vector<uint32_t>> regions;
    for (const uint32_t seed : order) {
      if (!taken_[seed]) {
        regions.push_back(Grow(seed));
      }
    }
    return regions;
  }

 private:
  struct Neighbour {
    uint32_t polygon = 0;
    bool agrees = true;  // the two run through their edge in opposite senses
  };

  void FindNeighbours() {
    neighbours_.resize(polygons_.size());
    const std::vector<PolygonSide> sides = SortedSides(polygons_);
    constexpr size_t kMostAtEdge = 8;  // more polygons are not all paired
    for (size_t first = 0; first < sides.size();) {
      size_t last = first;
      while (last < sides.size() && sides[last].low == sides[first].low &&
             sides[last].high == sides[first].high) {
        ++last;
      }
      const size_t end = std::min(last, first + kMostAtEdge);
      for (size_t i = first; i < end; ++i) {
        for (size_t j = i + 1; j < end; ++j) {
          AddPair(sides[i], sides[j]);
        }
      }
      first = last;
    }
  }

  void AddPair(const PolygonSide& a, const PolygonSide& b) {
    const bool agrees = a.forward != b.forward;
    if (a.polygon != b.polygon && kinds_[a.polygon] == kinds_[b.polygon] &&
        (agrees || !oriented_)) {
      neighbours_[a.polygon].push_back({b.polygon, agrees});
      neighbours_[b.polygon].push_back({a.polygon, agrees});
    }
  }

  std::vector<uint32_t> Grow(uint32_t seed) {
    const Vec3 normal = Normalize(areas_[seed]);
    const Point3 origin = vertices_[polygons_[seed][0]];
    std::vector<uint32_t> region{seed};
    taken_[seed] = true;
    for (size_t i = 0; i < region.size(); ++i) {
      for (const Neighbour& next : neighbours_[region[i]]) {
        if (taken_[next.polygon] ||
            !InPlane(next.polygon, origin, normal, next.agrees)) {
          continue;
        }
        taken_[next.polygon] = true;
        if (Dot(areas_[next.polygon], normal) < 0) {
          TurnRound(next.polygon);
        }
        region.push_back(next.polygon);
      }
    }
    return region;
  }

  // Whether the polygon lies in the plane and is not folded back: it must face
  // the way that the sense of the shared edge demands.
  [[nodiscard]] bool InPlane(uint32_t f,
                             Point3 origin,
                             Vec3 normal,
                             bool agrees) const {
    const double facing = Dot(areas_[f], normal) / Length(areas_[f]);
    if ((agrees ? facing : -facing) < kLeastNormalDot) {
      return false;
    }
    return std::all_of(
        polygons_[f].begin(), polygons_[f].end(), [&](uint32_t v) {
          return std::abs(Dot(vertices_[v] - origin, normal)) <=
                 tolerance_.plane;
        });
  }

  void TurnRound(uint32_t f) {
    std::reverse(polygons_[f].begin(), polygons_[f].end());
    areas_[f] = -areas_[f];
    for (Neighbour& next : neighbours_[f]) {
      next.agrees = !next.agrees;
    }
  }

  std::span<const Point3> vertices_;
  std::vector<VertexLoop>& polygons_;
  std::span<const uint32_t> kinds_;
  RegionTolerance tolerance_;
  bool oriented_;
  std::vector<Vec3> areas_;
  std::vector<std::vector<Neighbour>> neighbours_;
  std::vector<bool> taken_;
};

// Whether the loop visits a vertex twice, as an outline with bridged holes
// does.
bool TouchesItself(VertexLoop loop) {
  std::sort(loop.begin(), loop.end());
  return std::adjacent_find(loop.begin(), loop.end()) != loop.end();
}

// Keeps the library from printing refusals, which are expected and counted.
class QuietOpenMesh {
 public:
  QuietOpenMesh() { omerr().disable(); }

  ~QuietOpenMesh() { omerr().enable(); }

  QuietOpenMesh(const QuietOpenMesh&) = delete;
  QuietOpenMesh& operator=(const QuietOpenMesh&) = delete;
  QuietOpenMesh(QuietOpenMesh&&) = delete;
  QuietOpenMesh& operator=(QuietOpenMesh&&) = delete;
};

// The joined outline of a region: its boundary half-edges.
class Outline {
 public:
  Outline(std::span<const Point3> vertices,
          std::span<const VertexLoop> polygons) {
    std::unordered_map<uint32_t, Mesh::VertexHandle> handles;
    std::vector<Mesh::VertexHandle> corners;
    const QuietOpenMesh quiet;
    for (const VertexLoop& loop : polygons) {
      corners.clear();
      if (TouchesItself(loop)) {
        refused_.push_back(&loop);  // the library cannot link it
        continue;
      }
      for (const uint32_t v : loop) {
        const auto [it, is_new] = handles.try_emplace(v);
        if (is_new) {
          const Point3 p = vertices[v];
          it->second =
              Mesh::VertexHandle(mesh_.add_vertex({p.x, p.y, p.z}).idx());
        }
        corners.push_back(it->second);
      }
      if (!mesh_.add_face(corners).is_valid()) {
        refused_.push_back(&loop);
      }
    }
  }

  [[nodiscard]] const std::vector<const VertexLoop*>& Refused() const {
    return refused_;
  }

  // The boundary edges, interior on the left; each straight run is one edge.
  [[nodiscard]] std::vector<Edge3> Edges(double tolerance) const {
    std::vector<bool> seen(mesh_.n_halfedges(), false);
    std::vector<Edge3> edges;
    for (const auto h : mesh_.halfedges()) {
      if (!mesh_.is_boundary(h) || seen[Index(h)]) {
        continue;
      }
      std::vector<Point3> loop;
      for (auto at = h; !seen[Index(at)]; at = mesh_.next_halfedge_handle(at)) {
        seen[Index(at)] = true;
        loop.push_back(At(mesh_.to_vertex_handle(at)));
      }
      AppendStraightened(std::move(loop), tolerance, edges);
    }
    return edges;
  }

 private:
  struct Traits : OpenMesh::DefaultTraits {
    using Point = OpenMesh::Vec3d;
  };

  using Mesh = OpenMesh::PolyMesh_ArrayKernelT<Traits>;

  static size_t Index(Mesh::HalfedgeHandle h) {
    return static_cast<size_t>(h.idx());
  }

  [[nodiscard]] Point3 At(Mesh::VertexHandle v) const {
    const auto& p = mesh_.point(v);
    return {p[0], p[1], p[2]};
  }

  // Reverses the loop, because boundary half-edges have the outside on the
  // left.
  static void AppendStraightened(std::vector<Point3> loop,
                                 double tolerance,
                                 std::vector<Edge3>& edges) {
    std::reverse(loop.begin(), loop.end());
    AppendEdges(Straightened(loop, tolerance), false, edges);
  }

  Mesh mesh_;
  std::vector<const VertexLoop*> refused_;
};

// The convex pieces of a figure; empty if the figure has too few sides.
std::vector<std::vector<Point3>> CutOne(std::vector<Edge3> edges,
                                        Vec3 area,
                                        double tolerance) {
  if (auto convex = AsConvex(edges, area)) {
    return {std::move(*convex)};
  }
  return edges.size() < 3 ? std::vector<std::vector<Point3>>{}
                          : CutFigure(edges, area, tolerance);
}

std::vector<Edge3> LoopEdges(const std::vector<Point3>& points,
                             double tolerance) {
  std::vector<Edge3> edges;
  AppendEdges(Straightened(points, tolerance), false, edges);
  return edges;
}

std::vector<std::vector<Point3>> CutLoop(const std::vector<Point3>& points,
                                         double tolerance) {
  return CutOne(LoopEdges(points, tolerance), AreaVector(points), tolerance);
}

size_t TotalCost(const std::vector<std::vector<Point3>>& pieces,
                 double tolerance) {
  size_t cost = 0;
  for (const auto& piece : pieces) {
    const Vec3 gap = piece.size() == 4
                         ? (piece[0] - piece[1]) + (piece[2] - piece[3])
                         : Vec3{1, 0, 0};
    cost += Length(gap) <= 2 * tolerance ? 1 : piece.size() - 2;
  }
  return cost;
}

}  // namespace

std::vector<std::vector<uint32_t>> FindRegions(
    std::span<const Point3> vertices,
    std::vector<VertexLoop>& polygons,
    std::span<const uint32_t> kinds,
    const RegionTolerance& tolerance,
    bool oriented) {
  return RegionFinder(vertices, polygons, kinds, tolerance, oriented).Run();
}

RegionPieces CutRegionOf(std::span<const Point3> vertices,
                         std::span<const VertexLoop> polygons,
                         const RegionTolerance& tolerance) {
  // There are two covers to choose from: each polygon by itself, or all joined.
  RegionPieces result;
  std::vector<std::vector<Point3>> apart;
  for (const VertexLoop& loop : polygons) {
    const auto pieces = CutLoop(PointsOf(vertices, loop), tolerance.weld);
    apart.insert(apart.end(), pieces.begin(), pieces.end());
  }
  result.pieces = std::move(apart);
  if (polygons.size() == 1) {
    return result;
  }
  const Outline outline(vertices, polygons);
  std::vector<std::vector<Point3>> joined;
  Vec3 area;
  for (const VertexLoop& loop : polygons) {
    area = area + AreaVector(PointsOf(vertices, loop));
  }
  joined = CutOne(outline.Edges(tolerance.weld), area, tolerance.weld);
  for (const VertexLoop* loop : outline.Refused()) {
    const auto pieces = CutLoop(PointsOf(vertices, *loop), tolerance.weld);
    joined.insert(joined.end(), pieces.begin(), pieces.end());
  }
  result.refused = outline.Refused().size();
  const double wanted = Length(area);
  const double error = std::abs(TotalArea(joined) - wanted);
  double border = 0;
  for (const Edge3& e : outline.Edges(tolerance.weld)) {
    border += Length(e.to - e.from);
  }
  if (error <= 1e-9 * wanted + 2 * tolerance.weld * border &&
      TotalCost(joined, tolerance.weld) <=
          TotalCost(result.pieces, tolerance.weld)) {
    result.pieces = std::move(joined);
  }
  return result;
}

}  // namespace enfilade
