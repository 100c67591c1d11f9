// A polygon in its plane, and how near points and segments are to it.

#pragma once

#include "base/plane.h"
#include "base/vec.h"
#include "scene/polygon_cut.h"

#include <vector>

namespace enfilade {

// The point of a segment that is nearest to a given point.
struct OnSegment {
  double at = 0;        // 0 at the start, 1 at the end
  double distance = 0;  // between the two points, m
};

OnSegment NearestOnSegment(Point3 p, Point3 a, Point3 b);

class FlatPolygon {
 public:
  // Corners that are a little off the plane are projected into the plane.
  FlatPolygon(const std::vector<Point3>& outline, const Plane& plane);

  // Whether a point of the plane is inside the polygon or within the tolerance,
  // in metres, of it.
  [[nodiscard]] bool IsNear(Point3 p, double tolerance) const;

  // The length, in metres, of the part of a segment in the plane for which
  // IsNear holds.
  [[nodiscard]] double LengthNear(Point3 a, Point3 b, double tolerance) const;

 private:
  PlaneFrame frame_;
  Polygon2 corners_;
};

}  // namespace enfilade
