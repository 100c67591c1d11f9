// A polygon in its plane: how far points and segments of the plane are from it.

#pragma once

#include "base/vec.h"
#include "scene/plane_snap.h"
#include "scene/polygon_cut.h"

#include <vector>

namespace enfilade {

// The place of a segment that is nearest to a point.
struct OnSegment {
  double at = 0;        // 0 at the start, 1 at the end
  double distance = 0;  // of the point, m
};

OnSegment NearestOnSegment(Point3 p, Point3 a, Point3 b);

class FlatPolygon {
 public:
  // Corners that are a little off the plane are taken as if in it.
  FlatPolygon(const std::vector<Point3>& outline, const ScenePlane& plane);

  // Whether a point of the plane is inside or within the tolerance, m.
  [[nodiscard]] bool IsNear(Point3 p, double tolerance) const;

  // The metres of a segment of the plane that lie within the tolerance of the
  // polygon.
  [[nodiscard]] double LengthNear(Point3 a, Point3 b, double tolerance) const;

 private:
  PlaneFrame frame_;
  Polygon2 corners_;
};

}  // namespace enfilade
