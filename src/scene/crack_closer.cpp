#include "scene/crack_closer.h"

#include "scene/box_tree.h"
#include "scene/plane_snap.h"
#include "scene/polygon_cut.h"
#include "scene/weld.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace enfilade {
namespace {

using Loop = std::vector<uint32_t>;  // of vertex classes

// Vertices move by at most this many tolerances.
constexpr double kMostMoves = 4;
// Planes that are less than this sine off those that hold a vertex already say
// nothing about where it is.
constexpr double kLeastSine = 0.02;
constexpr double kOnPlane = 1e-7;
// A vertex so near an edge need not be a vertex of it.
constexpr double kOnEdge = 1e-6;
constexpr double kMovedMetres = 1e-6;

// An edge that runs along a polygon for so many tolerances lies on it.
constexpr double kAlongTolerances = 10;

struct OnSegment {
  double at = 0;  // 0 at the start, 1 at the end
  double distance = 0;
};

OnSegment Project(Point3 p, Point3 a, Point3 b) {
  const Vec3 along = b - a;
  const double square = Dot(along, along);
  const double at =
      square > 0 ? std::clamp(Dot(p - a, along) / square, 0.0, 1.0) : 0;
  return {at, Length(p - (a + along * at))};
}

// A polygon in its plane: how far points of the plane are from it.
class FlatPolygon {
 public:
  FlatPolygon(const std::vector<Point3>& outline, const ScenePlane& plane)
      : frame_(
            MakePlaneFrame(outline[0], plane.normal, outline[1] - outline[0])) {
    for (const Point3 p : outline) {
      corners_.push_back(frame_.To2(p));
    }
  }

  [[nodiscard]] bool IsNear(Point3 p, double tolerance) const {
    const Point2 q = frame_.To2(p);
    bool inside = false;
    for (size_t i = 0; i < corners_.size(); ++i) {
      const Point2 a = corners_[i];
      const Point2 b = corners_[(i + 1) % corners_.size()];
      const Point3 q3{q.x, q.y, 0};
      if (Project(q3, {a.x, a.y, 0}, {b.x, b.y, 0}).distance <= tolerance) {
        return true;
      }
      if ((a.y > q.y) != (b.y > q.y) &&
          q.x < a.x + (b.x - a.x) * (q.y - a.y) / (b.y - a.y)) {
        inside = !inside;
      }
    }
    return inside;
  }

  // The metres of the segment that lie within the tolerance of the polygon.
  [[nodiscard]] double LengthNear(Point3 a3,
                                  Point3 b3,
                                  double tolerance) const {
    const Point2 a = frame_.To2(a3);
    const Point2 b = frame_.To2(b3);
    std::vector<double> breaks{0, 1};
    for (size_t i = 0; i < corners_.size(); ++i) {
      AddBreaks(a, b, corners_[i], corners_[(i + 1) % corners_.size()], breaks);
    }
    std::sort(breaks.begin(), breaks.end());
    double share = 0;
    for (size_t i = 0; i + 1 < breaks.size(); ++i) {
      const double width = breaks[i + 1] - breaks[i];
      if (width > 0 &&
          IsNear(Lerp(a3, b3, breaks[i] + 0.5 * width), tolerance)) {
        share += width;
      }
    }
    return share * Length(b3 - a3);
  }

 private:
  // Where the segment passes the edge from p to q or its first end.
  static void AddBreaks(
      Point2 a, Point2 b, Point2 p, Point2 q, std::vector<double>& breaks) {
    const double dx = b.x - a.x;
    const double dy = b.y - a.y;
    const auto side = [&](Point2 r) {
      return dx * (r.y - a.y) - dy * (r.x - a.x);
    };
    const auto place = [&](Point2 r) {
      return (dx * (r.x - a.x) + dy * (r.y - a.y)) / (dx * dx + dy * dy);
    };
    const auto add = [&](double t) {
      if (t > 0 && t < 1) {
        breaks.push_back(t);
      }
    };
    add(place(p));
    const double sp = side(p);
    const double sq = side(q);
    if ((sp < 0) != (sq < 0)) {
      const double s = sp / (sp - sq);
      add(place({p.x + s * (q.x - p.x), p.y + s * (q.y - p.y)}));
    }
  }

  PlaneFrame frame_;
  Polygon2 corners_;
};

// One polygon, outline or opening, on its way.
struct Part {
  Loop loop;
  uint32_t plane = 0;
  bool is_opening = false;
  std::vector<Point3>* result = nullptr;
};

// A place that one or more vertices share.
struct Place {
  Point3 position;
  std::vector<uint32_t> planes;  // that it should lie in
  bool is_corner = false;        // of an outline, not of openings alone
};

// The point nearest to `start`, about, that lies in as many of the planes as
// possible, those first in order first.
Point3 Solve(Point3 start,
             const std::vector<uint32_t>& planes,
             const std::vector<ScenePlane>& all,
             double most_move) {
  Point3 p = start;
  std::array<Vec3, 3> basis;
  size_t rank = 0;
  for (const uint32_t index : planes) {
    if (rank == basis.size()) {
      break;
    }
    const ScenePlane& plane = all[index];
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
  CrackCloser(double tolerance, std::vector<PolygonWithOpenings>& polygons)
      : tolerance_(tolerance), welder_(tolerance) {
    std::vector<std::vector<Point3>> outlines;
    std::vector<PolygonWithOpenings*> with_area;
    for (PolygonWithOpenings& polygon : polygons) {
      if (Length(AreaVector(polygon.outline)) > tolerance * tolerance) {
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
      places_[place].planes.push_back(plane);
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

  // Notes the planes of the polygons that each place comes near, and of those
  // that an edge of it runs along.
  void FindTouchedPlanes() {
    const std::vector<Box3> boxes = Boxes();
    const BoxTree tree(boxes);
    for (size_t i = 0; i < parts_.size(); ++i) {
      if (parts_[i].is_opening) {
        continue;
      }
      const ScenePlane& plane = planes_[parts_[i].plane];
      const FlatPolygon flat(PointsOf(parts_[i]), plane);
      tree.ForOverlaps(Grown(boxes[i], tolerance_), [&](uint32_t other) {
        if (other != i) {
          TouchWith(parts_[i].plane, flat, parts_[other]);
        }
      });
    }
    for (Place& place : places_) {
      std::sort(place.planes.begin(), place.planes.end());
      place.planes.erase(std::unique(place.planes.begin(), place.planes.end()),
                         place.planes.end());
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
        places_[a].planes.push_back(plane);
      }
      if (is_in_plane(b) && flat.LengthNear(At(a), At(b), tolerance_) > least) {
        places_[a].planes.push_back(plane);
        places_[b].planes.push_back(plane);
      }
    }
  }

  void MoveVertices(CrackSummary& summary) {
    for (Place& place : places_) {
      const Point3 moved =
          Solve(place.position, place.planes, planes_, kMostMoves * tolerance_);
      const double by = Length(moved - place.position);
      summary.moved += by > kMovedMetres ? 1U : 0U;
      summary.greatest_move_m = std::max(summary.greatest_move_m, by);
      place.position = moved;
    }
  }

  // Vertices that fell together, and there-and-back edges.
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
      }
      part.loop = std::move(longer);
    }
  }

  // The places near the inside of the part's edge and in its plane that are
  // not on the edge already, in the order of the edge.
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
      const OnSegment on = Project(p, At(a), At(b));
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
  std::vector<ScenePlane> planes_;
  std::vector<Part> parts_;
  std::vector<Place> places_;
};

// Two copies of each vertex, its place and what finds it.
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
  return CrackCloser(tolerance, polygons).Run();
}

}  // namespace enfilade
