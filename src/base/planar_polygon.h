// Measures of planar polygons, given by their vertices in order.

#pragma once

#include "base/vec.h"

#include <algorithm>
#include <cstddef>
#include <limits>
#include <span>
#include <vector>

namespace enfilade {

// Visits the triangles of a fan about the first vertex, by their vertices. A
// convex polygon is their union.
template <typename Function>
void ForEachTriangle(std::span<const Point3> polygon, const Function& visit) {
  for (size_t i = 1; i + 1 < polygon.size(); ++i) {
    visit(polygon[0], polygon[i], polygon[i + 1]);
  }
}

// The area vector, summed over a triangle fan. Its length is the area in m2,
// its direction the right-hand normal. Zero for fewer than three vertices.
inline Vec3 AreaVector(std::span<const Point3> polygon) {
  Vec3 sum;
  ForEachTriangle(polygon, [&sum](Point3 a, Point3 b, Point3 c) {
    sum = sum + Cross(b - a, c - a);
  });
  return sum * 0.5;
}

// In m2.
inline double PolygonArea(std::span<const Point3> polygon) {
  return Length(AreaVector(polygon));
}

// In m2.
inline double TotalArea(std::span<const std::vector<Point3>> polygons) {
  double area = 0;
  for (const std::vector<Point3>& polygon : polygons) {
    area += PolygonArea(polygon);
  }
  return area;
}

// Roughly the height over the longest side, m: twice the area divided by the
// length of that side. Zero if all vertices are one point.
inline double Thickness(std::span<const Point3> polygon) {
  double longest = 0;
  for (size_t i = 0; i < polygon.size(); ++i) {
    longest = std::max(longest,
                       Length(polygon[(i + 1) % polygon.size()] - polygon[i]));
  }
  return longest > 0 ? 2 * PolygonArea(polygon) / longest : 0;
}

// The mean of the vertices. Requires at least one vertex.
inline Point3 VertexMean(std::span<const Point3> polygon) {
  Vec3 sum;
  for (const Point3& p : polygon) {
    sum = sum + (p - polygon.front());
  }
  return polygon.front() + sum / static_cast<double>(polygon.size());
}

// The range that something covers along an axis, measured from the origin.
struct AxisRange {
  double low = 0, high = 0;
};

// The range of the vertices; low > high if there are none.
inline AxisRange RangeAlong(std::span<const Point3> polygon, Vec3 axis) {
  AxisRange range = {std::numeric_limits<double>::infinity(),
                     -std::numeric_limits<double>::infinity()};
  for (const Point3 p : polygon) {
    const double h = Dot(axis, p - Point3{});
    range.low = std::min(range.low, h);
    range.high = std::max(range.high, h);
  }
  return range;
}

}  // namespace enfilade
