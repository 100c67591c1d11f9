#include "scene/mesh_cleaner.h"

#include "base/check.h"
#include "base/planar_polygon.h"
#include "base/stop.h"
#include "scene/closed_solid.h"
#include "scene/region_join.h"
#include "scene/vertex_loop.h"
#include "scene/weld.h"

#include <algorithm>
#include <cmath>
#include <set>

#include <fmt/format.h>

namespace enfilade {
namespace {

constexpr double kMostWeldMetres = 1e-4;
constexpr double kRelativeWeld = 1e-5;
// Of the largest coordinate: a few steps of double precision, so that what
// differs by rounding alone is one point, and cells of the welder have numbers.
constexpr double kLeastRelativeWeld = 1e-15;
constexpr double kPlaneWelds = 2;
// A solid must be thicker than this many weld distances.
constexpr double kBesideWelds = 4;
// Memory of cleaning: about 400 bytes per polygon and 100 per corner were
// measured; the rest is for the search for solids.
constexpr uint64_t kBytesPerPolygon = 600;
constexpr uint64_t kBytesPerCorner = 220;

// The distance within which points of these corners are one.
double WeldOf(const Box3& bounds) {
  double farthest = 0;
  for (size_t axis = 0; axis < 3; ++axis) {
    farthest = std::max(
        {farthest, std::abs(bounds.low[axis]), std::abs(bounds.high[axis])});
  }
  return std::max(
      std::min(kMostWeldMetres, kRelativeWeld * Length(bounds.Extent())),
      kLeastRelativeWeld * farthest);
}

bool IsPlanar(std::span<const Point3> points, double tolerance) {
  const Vec3 normal = Normalize(AreaVector(points));
  double low = 0;
  double high = 0;
  for (const Point3 p : points) {
    const double height = Dot(p - points[0], normal);
    low = std::min(low, height);
    high = std::max(high, height);
  }
  return high - low <= tolerance;
}

// A corner of a loop that is cut into triangles.
struct LoopCorner {
  uint32_t vertex = 0;
  // Of the corner's triangle: 1 / (2 sqrt 3) at most, negative if concave.
  double roundness = 0;
  uint32_t inside = 0;  // vertices of the loop in the triangle

  // The roundness; if vertices lie in the triangle, at most 0 and lower by 1
  // for each of them.
  [[nodiscard]] double Quality() const {
    return inside == 0 ? roundness : std::min(roundness, 0.0) - inside;
  }
};

// Ear clipping: cuts off the roundest convex corner whose triangle holds no
// other vertex, until three corners are left. A cut changes the triangles of
// the two corners beside it and the counts of vertices in all others, so the
// time grows with the square of the number of corners.
class LoopCutter {
 public:
  // `normal` tells convex from concave.
  LoopCutter(std::span<const Point3> vertices,
             const VertexLoop& loop,
             Vec3 normal)
      : vertices_(vertices), normal_(normal) {
    for (const uint32_t v : loop) {
      corners_.push_back({v});
    }
    for (size_t i = 0; i < corners_.size(); ++i) {
      Measure(i);
    }
  }

  std::vector<VertexLoop> Triangles() {
    std::vector<VertexLoop> triangles;
    while (corners_.size() > 3) {
      const size_t best = Best();
      triangles.push_back({corners_[Before(best)].vertex,
                           corners_[best].vertex,
                           corners_[After(best)].vertex});
      Cut(best);
    }
    triangles.push_back(
        {corners_[0].vertex, corners_[1].vertex, corners_[2].vertex});
    return triangles;
  }

 private:
  [[nodiscard]] size_t Before(size_t i) const {
    return (i == 0 ? corners_.size() : i) - 1;
  }

  [[nodiscard]] size_t After(size_t i) const {
    return i + 1 == corners_.size() ? 0 : i + 1;
  }

  [[nodiscard]] Point3 At(size_t i) const {
    return vertices_[corners_[i].vertex];
  }

  [[nodiscard]] double Side(Point3 from, Point3 to, Point3 p) const {
    return Dot(Cross(to - from, p - from), normal_);
  }

  // Whether p is in the triangle of corner i and none of its vertices.
  [[nodiscard]] bool IsInside(size_t i, Point3 p) const {
    const Point3 a = At(Before(i));
    const Point3 b = At(i);
    const Point3 c = At(After(i));
    return p != a && p != b && p != c && Side(a, b, p) >= 0 &&
           Side(b, c, p) >= 0 && Side(c, a, p) >= 0;
  }

  void Measure(size_t i) {
    ThrowIfStopRequested();
    const Point3 a = At(Before(i));
    const Point3 b = At(i);
    const Point3 c = At(After(i));
    LoopCorner& corner = corners_[i];
    corner.roundness = Side(a, b, c) / (Dot(c - a, c - a) + Dot(b - a, b - a) +
                                        Dot(c - b, c - b));
    corner.inside = 0;
    for (size_t j = 0; j < corners_.size(); ++j) {
      corner.inside += IsInside(i, At(j)) ? 1U : 0U;
    }
  }

  [[nodiscard]] size_t Best() const {
    size_t best = 0;
    double best_quality = -std::numeric_limits<double>::infinity();
    for (size_t i = 0; i < corners_.size(); ++i) {
      const double quality = corners_[i].Quality();
      if (quality > best_quality) {
        best_quality = quality;
        best = i;
      }
    }
    return best;
  }

  void Cut(size_t cut) {
    const Point3 gone = At(cut);
    for (size_t i = 0; i < corners_.size(); ++i) {
      corners_[i].inside -= IsInside(i, gone) ? 1U : 0U;
    }
    corners_.erase(corners_.begin() + static_cast<std::ptrdiff_t>(cut));
    const size_t after = cut == corners_.size() ? 0 : cut;
    Measure(after);
    Measure(Before(after));
  }

  std::span<const Point3> vertices_;
  Vec3 normal_;
  std::vector<LoopCorner> corners_;
};

// One batch while it is cleaned.
class Batch {
 public:
  Batch(CleaningCounts& counts, const CleaningOptions& options, double weld)
      : counts_(counts), options_(options), welder_(weld) {
    tolerance_.weld = weld;
    tolerance_.plane = kPlaneWelds * weld;
  }

  void Take(std::span<const Point3> corners) {
    ThrowIfStopRequested();
    VertexLoop loop;
    for (const Point3 p : corners) {
      const uint32_t v = welder_.Vertex(p);
      if (loop.empty() || loop.back() != v) {
        loop.push_back(v);
      }
    }
    while (loop.size() > 1 && loop.back() == loop.front()) {
      loop.pop_back();
    }
    if (IsThin(loop)) {
      ++counts_.zero_area;
      counts_.crossed += IsOnALine(loop) ? 0U : 1U;
    } else if (IsDuplicate(loop)) {
      ++counts_.duplicates;
    } else {
      Keep(std::move(loop));
    }
  }

  void Deliver() {
    // The face of a solid and a sheet in the same plane are not joined, because
    // only the former has the inside of a solid behind it.
    const PolygonSolids solids = FindClosedSolids(
        welder_.Vertices(), polygons_, kBesideWelds * tolerance_.weld);
    const auto regions = FindRegions(welder_.Vertices(),
                                     polygons_,
                                     solids.numbers,
                                     tolerance_,
                                     options_.oriented);
    std::vector<VertexLoop> members;
    for (const std::vector<uint32_t>& region : regions) {
      ThrowIfStopRequested();
      members.clear();
      for (const uint32_t f : region) {
        members.push_back(polygons_[f]);
      }
      const RegionPieces cut =
          CutRegionOf(welder_.Vertices(), members, tolerance_);
      if (region.size() > 1) {
        ++counts_.regions;
        counts_.joined += region.size();
        counts_.non_manifold += cut.refused;
      }
      EmitAll(cut.pieces, solids.solids[region.front()]);
    }
  }

 private:
  // Delivers the pieces of a region.
  void EmitAll(const std::vector<std::vector<Point3>>& pieces,
               const std::optional<ClosedSolid>& solid) {
    const double area = TotalArea(pieces);
    counts_.faces += pieces.size();
    for (const std::vector<Point3>& piece : pieces) {
      options_.emit({piece, solid, area});
    }
  }

  [[nodiscard]] bool IsThin(const VertexLoop& loop) const {
    return loop.size() < 3 ||
           Thickness(PointsOf(welder_.Vertices(), loop)) < tolerance_.weld;
  }

  // Whether all vertices lie on the line along the longest side.
  [[nodiscard]] bool IsOnALine(const VertexLoop& loop) const {
    Point3 from;
    Vec3 along;
    for (size_t i = 0; i < loop.size(); ++i) {
      const Point3 a = welder_.Vertices()[loop[i]];
      const Vec3 side = welder_.Vertices()[loop[(i + 1) % loop.size()]] - a;
      if (Length(side) > Length(along)) {
        from = a;
        along = side;
      }
    }
    return std::all_of(loop.begin(), loop.end(), [&](uint32_t v) {
      return Length(Cross(welder_.Vertices()[v] - from, along)) <=
             tolerance_.weld * Length(along);
    });
  }

  // Whether a loop with the same vertices in the same cyclic order came before;
  // unless faces are oriented, also in the opposite order.
  bool IsDuplicate(const VertexLoop& loop) {
    VertexLoop key = Canonical(loop);
    if (!options_.oriented) {
      VertexLoop reversed(loop.rbegin(), loop.rend());
      key = std::min(key, Canonical(reversed));
    }
    return !seen_.insert(std::move(key)).second;
  }

  static VertexLoop Canonical(VertexLoop loop) {
    std::rotate(
        loop.begin(), std::min_element(loop.begin(), loop.end()), loop.end());
    return loop;
  }

  void Keep(VertexLoop loop) {
    const std::vector<Point3> points = PointsOf(welder_.Vertices(), loop);
    if (loop.size() == 3 || IsPlanar(points, tolerance_.plane)) {
      polygons_.push_back(std::move(loop));
      return;
    }
    ++counts_.warped;
    LoopCutter cutter(welder_.Vertices(), loop, AreaVector(points));
    for (VertexLoop& triangle : cutter.Triangles()) {
      if (!IsThin(triangle)) {
        polygons_.push_back(std::move(triangle));
      }
    }
  }

  CleaningCounts& counts_;
  const CleaningOptions& options_;
  Welder welder_;
  RegionTolerance tolerance_;
  std::vector<VertexLoop> polygons_;
  std::set<VertexLoop> seen_;
};

}  // namespace

std::vector<std::string> CleaningCounts::Notes() const {
  std::vector<std::string> notes;
  const auto add = [&](uint64_t count, const char* text) {
    if (count > 0) {
      notes.push_back(fmt::format("{} {}", count, text));
    }
  };
  add(zero_area - crossed, "polygons without area were dropped");
  add(crossed,
      "polygons cross themselves and were dropped, because nothing is left of "
      "their area: put their corners in order");
  add(duplicates, "polygons that were there twice were dropped");
  add(warped, "polygons that were not planar were cut into triangles");
  add(non_manifold, "polygons at non-manifold edges were kept as own sheets");
  if (regions > 0) {
    notes.push_back(fmt::format(
        "{} coplanar polygons were joined into {} regions", joined, regions));
  }
  if (polygons != faces) {
    notes.push_back(fmt::format(
        "{} polygons were read and {} faces kept", polygons, faces));
  }
  return notes;
}

bool MeshCleaner::HasRoomFor(size_t corners) const {
  return ends_.empty() || (ends_.size() < kMostPolygons &&
                           corners_.size() + corners <= kMostCorners);
}

void MeshCleaner::Add(std::span<const Point3> polygon) {
  ENFILADE_CHECK(polygon.size() >= 3, "{} vertices", polygon.size());
  corners_.insert(corners_.end(), polygon.begin(), polygon.end());
  ends_.push_back(corners_.size());
}

void MeshCleaner::Flush(const CleaningOptions& options) {
  if (ends_.empty()) {
    return;
  }
  const MemoryCharge charge(
      *budget_,
      ends_.size() * kBytesPerPolygon + corners_.size() * kBytesPerCorner,
      "cleaning the scene's polygons");
  const Box3 bounds = BoundsOf(corners_);
  if (Length(bounds.Extent()) > 0) {
    Batch batch(counts_, options, WeldOf(bounds));
    size_t begin = 0;
    for (const size_t end : ends_) {
      batch.Take(std::span(corners_).subspan(begin, end - begin));
      begin = end;
    }
    batch.Deliver();
  } else {
    counts_.zero_area += ends_.size();
  }
  counts_.polygons += ends_.size();
  corners_.clear();
  ends_.clear();
}

}  // namespace enfilade
