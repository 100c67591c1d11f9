#include "partition/polygon.h"

#include "base/directions.h"
#include "base/memory.h"
#include "base/stop.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

namespace enfilade {
namespace {

// A vertex this close to the line through its neighbours is not a corner; far
// from the origin, where coordinates are rounded to more than that, nor is one
// that is closer than this share of its coordinates.
constexpr double kStraightM = 1e-9;
constexpr double kStraightShare = 1e-15;

// A normal this close to an axis is that axis, but for rounding.
constexpr double kAxisTolerance = 1e-9;

double SnappedDistance(Point3 p, const Plane& plane, double tolerance_m) {
  const double d = plane.Distance(p);
  return std::abs(d) <= tolerance_m ? 0.0 : d;
}

bool HasEdgeWithin(const Polygon& polygon,
                   const Plane& plane,
                   double tolerance_m) {
  bool before = std::abs(plane.Distance(polygon.back())) <= tolerance_m;
  for (const Point3& p : polygon) {
    const bool here = std::abs(plane.Distance(p)) <= tolerance_m;
    if (here && before) {
      return true;
    }
    before = here;
  }
  return false;
}

bool IsAlongAxis(const Vec3& direction) {
  const double along = std::max(
      {std::abs(direction.x), std::abs(direction.y), std::abs(direction.z)});
  return Length(direction) - along <= kAxisTolerance * along;
}

// Appends polygon \ cover. A cover that overlaps by less than a crack leaves
// the polygon whole.
void SubtractOne(Polygon polygon,
                 const Vec3& normal,
                 const Polygon& cover,
                 double oblique_crack_m,
                 std::vector<Polygon>& outside) {
  const double turn = Dot(AreaVector(cover), normal) > 0 ? 1.0 : -1.0;
  std::vector<Polygon> cut_off;
  Polygon rest = polygon;
  for (size_t i = 0; i < cover.size(); ++i) {
    const Point3 a = cover[i];
    const Vec3 edge = cover[(i + 1) % cover.size()] - a;
    if (Length(edge) < kRoundingM) {
      continue;
    }
    const Vec3 out = Normalize(Cross(edge, normal)) * turn;
    const Plane side{out, Dot(out, Vec3{a.x, a.y, a.z})};
    const double crack_m = IsAlongAxis(out) ? kCrackM : oblique_crack_m;
    const PlaneSide where = Classify(rest, side, crack_m);
    if (where == PlaneSide::kFront) {
      outside.push_back(std::move(polygon));
      return;
    }
    if (where == PlaneSide::kCut) {
      SplitPolygons parts = Split(rest, side, kRoundingM);
      cut_off.push_back(std::move(parts.front));
      rest = std::move(parts.back);
    }
  }
  std::move(cut_off.begin(), cut_off.end(), std::back_inserter(outside));
}

uint64_t CornerBytes(const std::vector<Polygon>& polygons) {
  uint64_t bytes = 0;
  for (const Polygon& polygon : polygons) {
    bytes += AllocatedBytes(polygon.capacity() * sizeof(Point3));
  }
  return bytes;
}

}  // namespace

Plane PlaneOf(const Polygon& polygon) {
  const Vec3 normal =
      SnappedToAxis(Normalize(AreaVector(polygon)), kAxisTolerance);
  const Point3 mean = VertexMean(polygon);
  return {normal, Dot(normal, Vec3{mean.x, mean.y, mean.z})};
}

Plane EdgePlane(Point3 from, Point3 to, Vec3 normal) {
  const Vec3 inward = Normalize(Cross(normal, to - from));
  return {inward, Dot(inward, from - Point3{})};
}

std::vector<Polygon> PlanarParts(const Polygon& polygon) {
  const Plane plane = PlaneOf(polygon);
  const bool planar =
      std::all_of(polygon.begin(), polygon.end(), [&plane](const Point3& p) {
        return std::abs(plane.Distance(p)) <= kPlanarM;
      });
  if (planar) {
    return {polygon};
  }
  std::vector<Polygon> parts;
  ForEachTriangle(polygon, [&parts](Point3 a, Point3 b, Point3 c) {
    Polygon triangle{a, b, c};
    if (PolygonArea(triangle) > kLeastAreaM2) {
      parts.push_back(std::move(triangle));
    }
  });
  return parts;
}

PlaneSide Classify(const Polygon& polygon,
                   const Plane& plane,
                   double tolerance_m) {
  bool front = false;
  bool back = false;
  for (const Point3& p : polygon) {
    const double d = plane.Distance(p);
    front = front || d > tolerance_m;
    back = back || d < -tolerance_m;
  }
  if (front && back) {
    return PlaneSide::kCut;
  }
  return front ? PlaneSide::kFront : back ? PlaneSide::kBack : PlaneSide::kOn;
}

SplitPolygons Split(const Polygon& polygon,
                    const Plane& plane,
                    double tolerance_m) {
  // A polygon nearly parallel to the plane may have whole edges within the
  // tolerance. If these edges were snapped, the parts would overlap.
  const double tolerance =
      HasEdgeWithin(polygon, plane, tolerance_m) ? 0.0 : tolerance_m;
  SplitPolygons parts;
  for (size_t i = 0; i < polygon.size(); ++i) {
    const Point3 a = polygon[i];
    const Point3 b = polygon[(i + 1) % polygon.size()];
    const double da = SnappedDistance(a, plane, tolerance);
    const double db = SnappedDistance(b, plane, tolerance);
    if (da >= 0) {
      parts.front.push_back(a);
    }
    if (da <= 0) {
      parts.back.push_back(a);
    }
    if (da * db < 0) {
      // Always interpolates from front to back, so that two polygons cut a
      // shared edge at the same point.
      const Point3 cut =
          da > 0 ? Lerp(a, b, da / (da - db)) : Lerp(b, a, db / (db - da));
      parts.front.push_back(cut);
      parts.back.push_back(cut);
    }
  }
  return parts;
}

Polygon ClipToFront(const Polygon& polygon,
                    const Plane& plane,
                    double tolerance_m) {
  switch (Classify(polygon, plane, tolerance_m)) {
    case PlaneSide::kOn:
    case PlaneSide::kFront:
      return polygon;
    case PlaneSide::kBack:
      return {};
    case PlaneSide::kCut:
      break;
  }
  return Split(polygon, plane, tolerance_m).front;
}

Polygon RectangleAround(const Box3& box, const Plane& plane) {
  const NormalAxes axes = AxesAbout(plane.normal);
  const Point3 center =
      box.Center() - plane.normal * plane.Distance(box.Center());
  const double r = Length(box.Extent()) + 1.0;
  return {center - axes.u * r - axes.v * r,
          center + axes.u * r - axes.v * r,
          center + axes.u * r + axes.v * r,
          center - axes.u * r + axes.v * r};
}

std::vector<Polygon> Subtract(
    const Polygon& polygon,
    const Vec3& normal,
    const std::vector<const Polygon*>& covers,
    double oblique_crack_m,
    const std::function<void(uint64_t, double)>& grow) {
  // The pieces before and after a cover is removed, in growing vectors.
  constexpr uint64_t kBytesEach = 4 * sizeof(Polygon);
  constexpr size_t kFew = 256;
  size_t told = kFew;
  std::vector<Polygon> left{polygon};
  for (size_t i = 0; i < covers.size(); ++i) {
    ThrowIfStopRequested();
    std::vector<Polygon> outside;
    for (Polygon& piece : left) {
      SubtractOne(
          std::move(piece), normal, *covers[i], oblique_crack_m, outside);
    }
    left = std::move(outside);
    if (grow && left.size() > told) {
      told = left.size() + left.size() / 8;
      grow(CornerBytes(left) / left.size() * told + told * kBytesEach,
           static_cast<double>(i + 1) / static_cast<double>(covers.size()));
    }
  }
  return left;
}

Polygon WithoutStraightCorners(const Polygon& polygon) {
  Polygon kept;
  const size_t n = polygon.size();
  const double straight_m =
      n == 0 ? kStraightM
             : std::max(kStraightM,
                        kStraightShare * Length(polygon[0] - Point3{}));
  for (size_t i = 0; i < n; ++i) {
    const Point3 before = kept.empty() ? polygon[n - 1] : kept.back();
    const Vec3 in = polygon[i] - before;
    const Vec3 out = polygon[(i + 1) % n] - polygon[i];
    const double bend = Length(Cross(in, out));
    const double longer = std::max(Length(in), Length(out));
    if (bend > straight_m * longer || Dot(in, out) < -straight_m * longer) {
      kept.push_back(polygon[i]);
    }
  }
  return kept.size() < 3 ? Polygon{} : kept;
}

Polygon ConvexHull(const std::vector<Point3>& points, const Vec3& normal) {
  const NormalAxes axes = AxesAbout(normal);

  struct Point2 {
    double x, y;
    Point3 at;
  };

  std::vector<Point2> sorted;
  sorted.reserve(points.size());
  for (const Point3& p : points) {
    const Vec3 d = p - points.front();
    sorted.push_back({Dot(d, axes.u), Dot(d, axes.v), p});
  }
  std::sort(sorted.begin(), sorted.end(), [](const Point2& a, const Point2& b) {
    return a.x != b.x ? a.x < b.x : a.y < b.y;
  });
  // Andrew's monotone chain, lower then upper.
  std::vector<Point2> hull;
  const auto add = [&hull](const Point2& p, size_t least) {
    while (hull.size() >= least + 2) {
      const Point2& a = hull[hull.size() - 2];
      const Point2& b = hull.back();
      const double cross =
          (b.x - a.x) * (p.y - a.y) - (b.y - a.y) * (p.x - a.x);
      if (cross > 0) {
        break;
      }
      hull.pop_back();
    }
    hull.push_back(p);
  };
  for (const Point2& p : sorted) {
    add(p, 0);
  }
  const size_t lower = hull.size();
  for (size_t i = sorted.size() - 1; i-- > 0;) {
    add(sorted[i], lower - 1);
  }
  hull.pop_back();
  Polygon result;
  result.reserve(hull.size());
  for (const Point2& p : hull) {
    result.push_back(p.at);
  }
  return WithoutStraightCorners(result);
}

}  // namespace enfilade
