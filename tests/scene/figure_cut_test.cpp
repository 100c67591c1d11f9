#include "scene/figure_cut.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <gtest/gtest.h>

namespace enfilade {
namespace {

constexpr double kStraightTolerance = 1e-4;

// A half disc: an arc of `steps` edges and the diameter.
Polygon3 HalfDisc(double radius, int steps) {
  Polygon3 loop;
  for (int i = 0; i <= steps; ++i) {
    const double angle = std::numbers::pi * i / steps;
    loop.push_back({radius * std::cos(angle), radius * std::sin(angle), 0});
  }
  return loop;
}

double DistanceToSegment(Point3 p, Point3 a, Point3 b) {
  const Vec3 along = b - a;
  const double t = std::clamp(Dot(p - a, along) / Dot(along, along), 0.0, 1.0);
  return Length(p - (a + along * t));
}

double DistanceToLoop(Point3 p, const Polygon3& loop) {
  double least = std::numeric_limits<double>::infinity();
  for (size_t i = 0; i < loop.size(); ++i) {
    least = std::min(
        least, DistanceToSegment(p, loop[i], loop[(i + 1) % loop.size()]));
  }
  return least;
}

// Each vertex of a fine arc lies nearly on the line through its neighbours, but
// all of them must not be cut off one after the other.
TEST(StraightenedTest, AnArcKeepsItsPlace) {
  for (const double radius : {0.5, 10.0, 100.0}) {
    const Polygon3 arc = HalfDisc(radius, 2000);
    const Polygon3 kept = Straightened(arc, kStraightTolerance);
    EXPECT_GE(kept.size(), 4U);
    for (const Point3 p : arc) {
      EXPECT_LE(DistanceToLoop(p, kept), kStraightTolerance * 1.001) << radius;
    }
  }
}

TEST(StraightenedTest, VerticesOnStraightEdgesGo) {
  // The first and the last vertex lie within one edge.
  const Polygon3 loop = {{1, 0, 0},
                         {2, 0, 0},
                         {2, 1, 0},
                         {1, 1, 0},
                         {0, 1, 0},
                         {0, 0, 0},
                         {.5, 0, 0}};
  const Polygon3 kept = Straightened(loop, kStraightTolerance);
  const Polygon3 corners = {{2, 0, 0}, {2, 1, 0}, {0, 1, 0}, {0, 0, 0}};
  EXPECT_EQ(kept, corners);
}

}  // namespace
}  // namespace enfilade
