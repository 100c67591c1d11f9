#include "scene/crack_closer.h"

#include "base/planar_polygon.h"
#include "base/stop.h"
#include "scene/box_tree.h"
#include "scene/flat_polygon.h"
#include "scene/plane_snap.h"
#include "scene/weld.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace enfilade {
namespace {

using Loop = std::vector<uint32_t>;  // indices of places

// Vertices move by at most this many tolerances.
constexpr double kMostMoves = 4;
// A plane is ignored if its normal is less than this sine away from the span of
// the normals that hold a vertex already.
constexpr double kLeastSine = 0.02;
constexpr double kOnPlane = 1e-7;
// A vertex this near an edge is exact already and not added to the edge.
constexpr double kOnEdge = 1e-6;
constexpr double kMovedMetres = 1e-6;
constexpr size_t kFewPlanes = 4;

// An edge that runs along a polygon for more than so many tolerances lies on
// the polygon.
constexpr double kAlongTolerances = 10;

// One polygon, an outline or an opening, while it is repaired.
struct Part {
  Loop loop;
  uint32_t plane = 0;
  bool is_opening = false;
  std::vector<Point3>* result = nullptr;
};

// A place that one or more vertices share.
struct Place {
  Point3 position;
  std::vector<uint32_t> planes;  // planes that it should lie in
  bool is_corner = false;        // of an outline, not of openings alone
};

// Approximately the nearest point to `start`, at most `most_move` away, that
// lies in as many of the planes as possible; earlier planes take precedence.
Point3 Solve(Point3 start,
             const std::vector<uint32_t>& planes,
             const std::vector<Plane>& all,
             double most_move) {
  Point3 p = start;
  std::array<Vec3, 3> basis;
  size_t rank = 0;
  for (const uint32_t index : planes) {
    if (rank == basis.size()) {
      break;
    }
    const Plane& plane = all[index];
    Vec3 free = plane.normal;
    for (size_t i = 0; i < rank; ++i) {
      free = free - basis[i] * Dot(free, basis[i]);
    }
    const double sine = Length(free);
    if (sine < kLeastSine) {
      continue;
    }
    const Point3 moved = p - free * (plane.Distance(p) / (sine * sine));
    if (Length(moved - start) > most_move) {
      continue;
    }
    p = moved;
    basis[rank++] = free / sine;
  }
  return p;
}

class CrackCloser {
 public:
  CrackCloser(double tolerance,
              MemoryBudget& budget,
              std::vector<PolygonWithOpenings>& polygons)
      : tolerance_(tolerance),
        welder_(tolerance),
        touches_(budget, "surfaces that touch") {
    std::vector<std::vector<Point3>> outlines;
    std::vector<PolygonWithOpenings*> with_area;
    for (PolygonWithOpenings& polygon : polygons) {
      if (PolygonArea(polygon.outline) > tolerance * tolerance) {
        outlines.push_back(polygon.outline);
        with_area.push_back(&polygon);
      }
    }
    SnappedPlanes snapped = SnapPlanes(outlines, tolerance);
    planes_ = std::move(snapped.planes);
    for (size_t i = 0; i < with_area.size(); ++i) {
      AddPart(with_area[i]->outline, snapped.plane_of[i], false);
      for (std::vector<Point3>& opening : with_area[i]->openings) {
        AddPart(opening, snapped.plane_of[i], true);
      }
    }
    for (size_t i = 0; i < welder_.Vertices().size(); ++i) {
      places_[i].position = welder_.Vertices()[i];
    }
  }

  CrackSummary Run() {
    FindTouchedPlanes();
    CrackSummary summary;
    MoveVertices(summary);
    for (Part& part : parts_) {
      DropDoubles(part.loop);
    }
    AddTouchingVertices(summary);
    WriteBack();
    return summary;
  }

 private:
  void AddPart(std::vector<Point3>& polygon, uint32_t plane, bool is_opening) {
    Part part{{}, plane, is_opening, &polygon};
    for (const Point3 p : polygon) {
      const uint32_t place = welder_.Vertex(p);
      places_.resize(welder_.Vertices().size());
      NotePlane(place, plane);
      places_[place].is_corner = places_[place].is_corner || !is_opening;
      part.loop.push_back(place);
    }
    parts_.push_back(std::move(part));
  }

  [[nodiscard]] Point3 At(uint32_t place) const {
    return places_[place].position;
  }

  [[nodiscard]] std::vector<Point3> PointsOf(const Part& part) const {
    std::vector<Point3> points;
    for (const uint32_t place : part.loop) {
      points.push_back(At(place));
    }
    return points;
  }

  [[nodiscard]] std::vector<Box3> Boxes() const {
    std::vector<Box3> boxes(parts_.size());
    for (size_t i = 0; i < parts_.size(); ++i) {
      for (const uint32_t place : parts_[i].loop) {
        boxes[i].Include(At(place));
      }
    }
    return boxes;
  }

  // Notes for each place the planes of the polygons that it is near, and of
  // the polygons that one of its edges runs along.
  void FindTouchedPlanes() {
    const std::vector<Box3> boxes = Boxes();
    const BoxTree tree(boxes);
    for (size_t i = 0; i < parts_.size(); ++i) {
      ThrowIfStopRequested();
      if (parts_[i].is_opening) {
        continue;
      }
      const Plane& plane = planes_[parts_[i].plane];
      const FlatPolygon flat(PointsOf(parts_[i]), plane);
      tree.ForOverlaps(Grown(boxes[i], tolerance_), [&](uint32_t other) {
        if (other != i) {
          TouchWith(parts_[i].plane, flat, parts_[other]);
        }
      });
    }
    for (Place& place : places_) {
      DropEquals(&place.planes);
    }
  }

  static void DropEquals(std::vector<uint32_t>* planes) {
    std::sort(planes->begin(), planes->end());
    planes->erase(std::unique(planes->begin(), planes->end()), planes->end());
  }

  // Where many surfaces coincide, all of them note the same plane for a vertex;
  // duplicates are dropped before the list may grow.
  void NotePlane(uint32_t place, uint32_t plane) {
    std::vector<uint32_t>& planes = places_[place].planes;
    if (planes.size() == planes.capacity()) {
      DropEquals(&planes);
      const size_t most = std::max(kFewPlanes, 2 * planes.size());
      if (most > planes.capacity()) {
        ChargeTouches((most - planes.capacity()) * sizeof(uint32_t));
        planes.reserve(most);
      }
    }
    planes.push_back(plane);
  }

  void ChargeTouches(uint64_t bytes) {
    touch_bytes_ += bytes;
    if (touch_bytes_ > charged_bytes_) {
      charged_bytes_ = touch_bytes_ + touch_bytes_ / 2;
      touches_.GrowTo(charged_bytes_);
    }
  }

  void TouchWith(uint32_t plane, const FlatPolygon& flat, const Part& part) {
    const double least = kAlongTolerances * tolerance_;
    const auto is_in_plane = [&](uint32_t place) {
      return std::abs(planes_[plane].Distance(At(place))) <= tolerance_;
    };
    for (size_t k = 0; k < part.loop.size(); ++k) {
      const uint32_t a = part.loop[k];
      const uint32_t b = part.loop[(k + 1) % part.loop.size()];
      if (!is_in_plane(a)) {
        continue;
      }
      if (flat.IsNear(At(a), tolerance_)) {
        NotePlane(a, plane);
      }
      if (is_in_plane(b) && flat.LengthNear(At(a), At(b), tolerance_) > least) {
        NotePlane(a, plane);
        NotePlane(b, plane);
      }
    }
  }

  void MoveVertices(CrackSummary& summary) {
    for (Place& place : places_) {
      place.position =
          Solve(place.position, place.planes, planes_, kMostMoves * tolerance_);
    }
    for (const Part& part : parts_) {
      for (size_t k = 0; k < part.loop.size(); ++k) {
        const double by = Length(At(part.loop[k]) - (*part.result)[k]);
        summary.moved += by > kMovedMetres ? 1U : 0U;
        summary.greatest_move_m = std::max(summary.greatest_move_m, by);
      }
    }
  }

  // Drops vertices that fell together, and edges that run there and back.
  static void DropDoubles(Loop& loop) {
    bool dropped = true;
    while (dropped && loop.size() > 1) {
      dropped = false;
      for (size_t i = 0; i < loop.size() && loop.size() > 1; ++i) {
        const size_t next = (i + 1) % loop.size();
        const size_t after = (i + 2) % loop.size();
        if (loop[i] == loop[next] || loop[i] == loop[after]) {
          loop.erase(loop.begin() + static_cast<std::ptrdiff_t>(next));
          dropped = true;
          break;
        }
      }
    }
  }

  void AddTouchingVertices(CrackSummary& summary) {
    std::vector<Box3> points(places_.size());
    for (size_t i = 0; i < places_.size(); ++i) {
      if (places_[i].is_corner) {
        points[i].Include(places_[i].position);
      }
    }
    const BoxTree tree(std::move(points));
    for (Part& part : parts_) {
      if (part.is_opening) {
        continue;
      }
      Loop longer;
      for (size_t k = 0; k < part.loop.size(); ++k) {
        longer.push_back(part.loop[k]);
        const auto touching = TouchingEdge(
            part, part.loop[k], part.loop[(k + 1) % part.loop.size()], tree);
        longer.insert(longer.end(), touching.begin(), touching.end());
        summary.added += touching.size();
        ChargeTouches(touching.size() *
                      (2 * sizeof(uint32_t) + sizeof(Point3)));
      }
      part.loop = std::move(longer);
    }
  }

  // The places in the part's plane that are near the interior of its edge from
  // a to b but not on the edge already, in order from a to b.
  [[nodiscard]] Loop TouchingEdge(const Part& part,
                                  uint32_t a,
                                  uint32_t b,
                                  const BoxTree& tree) const {
    Box3 box;
    box.Include(At(a));
    box.Include(At(b));
    std::vector<std::pair<double, uint32_t>> found;
    tree.ForOverlaps(Grown(box, tolerance_), [&](uint32_t place) {
      const Point3 p = At(place);
      const OnSegment on = NearestOnSegment(p, At(a), At(b));
      const bool inside =
          std::min(Length(p - At(a)), Length(p - At(b))) > tolerance_;
      if (inside && on.distance > kOnEdge && on.distance <= tolerance_ &&
          std::abs(planes_[part.plane].Distance(p)) <= kOnPlane &&
          std::find(part.loop.begin(), part.loop.end(), place) ==
              part.loop.end()) {
        found.emplace_back(on.at, place);
      }
    });
    std::sort(found.begin(), found.end());
    Loop touching;
    for (const auto& [at, place] : found) {
      touching.push_back(place);
    }
    return touching;
  }

  void WriteBack() {
    for (const Part& part : parts_) {
      *part.result = PointsOf(part);
    }
  }

  double tolerance_;
  Welder welder_;
  std::vector<Plane> planes_;
  std::vector<Part> parts_;
  std::vector<Place> places_;
  // Charges the planes and the vertices of touching surfaces.
  GrowingCharge touches_;
  uint64_t touch_bytes_ = 0;
  uint64_t charged_bytes_ = 0;
};

// The bytes of two copies of each vertex, of its place and of its index entry.
uint64_t BytesFor(const std::vector<PolygonWithOpenings>& polygons) {
  constexpr uint64_t kBytesPerVertex = 400;
  constexpr uint64_t kBytesPerPolygon = 400;
  uint64_t bytes = 0;
  for (const PolygonWithOpenings& polygon : polygons) {
    bytes += kBytesPerPolygon * (1 + polygon.openings.size()) +
             kBytesPerVertex * polygon.outline.size();
    for (const auto& opening : polygon.openings) {
      bytes += kBytesPerVertex * opening.size();
    }
  }
  return bytes;
}

}  // namespace

CrackSummary CloseCracks(double tolerance,
                         MemoryBudget& budget,
                         std::vector<PolygonWithOpenings>& polygons) {
  const MemoryCharge charge(
      budget, BytesFor(polygons), "closing the cracks between surfaces");
  return CrackCloser(tolerance, budget, polygons).Run();
}

}  // namespace enfilade
