#include "scene/flat_polygon.h"

#include <algorithm>
#include <cstddef>

namespace enfilade {
namespace {

// Adds the fractions at which the segment from a to b crosses the edge from p
// to q and passes p.
void AddBreaks(
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

}  // namespace

OnSegment NearestOnSegment(Point3 p, Point3 a, Point3 b) {
  const Vec3 along = b - a;
  const double square = Dot(along, along);
  const double at =
      square > 0 ? std::clamp(Dot(p - a, along) / square, 0.0, 1.0) : 0;
  return {at, Length(p - (a + along * at))};
}

FlatPolygon::FlatPolygon(const std::vector<Point3>& outline, const Plane& plane)
    : frame_(
          MakePlaneFrame(outline[0], plane.normal, outline[1] - outline[0])) {
  for (const Point3 p : outline) {
    corners_.push_back(frame_.To2(p));
  }
}

bool FlatPolygon::IsNear(Point3 p, double tolerance) const {
  const Point2 q = frame_.To2(p);
  bool inside = false;
  for (size_t i = 0; i < corners_.size(); ++i) {
    const Point2 a = corners_[i];
    const Point2 b = corners_[(i + 1) % corners_.size()];
    const Point3 q3{q.x, q.y, 0};
    if (NearestOnSegment(q3, {a.x, a.y, 0}, {b.x, b.y, 0}).distance <=
        tolerance) {
      return true;
    }
    if ((a.y > q.y) != (b.y > q.y) &&
        q.x < a.x + (b.x - a.x) * (q.y - a.y) / (b.y - a.y)) {
      inside = !inside;
    }
  }
  return inside;
}

double FlatPolygon::LengthNear(Point3 a3, Point3 b3, double tolerance) const {
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
    if (width > 0 && IsNear(Lerp(a3, b3, breaks[i] + 0.5 * width), tolerance)) {
      share += width;
    }
  }
  return share * Length(b3 - a3);
}

}  // namespace enfilade
