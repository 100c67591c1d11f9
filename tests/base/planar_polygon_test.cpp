#include "base/planar_polygon.h"

#include <gtest/gtest.h>

namespace enfilade {
namespace {

using Polygon3 = std::vector<Point3>;

// 3 by 2, facing up.
const Polygon3 kRectangle = {{1, 1, 5}, {4, 1, 5}, {4, 3, 5}, {1, 3, 5}};

TEST(PlanarPolygon, TrianglesOfAFanMakeUpThePolygon) {
  double area = 0;
  size_t count = 0;
  ForEachTriangle(kRectangle, [&](Point3 a, Point3 b, Point3 c) {
    EXPECT_EQ(a, kRectangle[0]);
    area += PolygonArea(Polygon3{a, b, c});
    ++count;
  });
  EXPECT_EQ(count, 2U);
  EXPECT_EQ(area, PolygonArea(kRectangle));
}

TEST(PlanarPolygon, AreaVectorFollowsTheRightHand) {
  EXPECT_EQ(AreaVector(kRectangle), (Vec3{0, 0, 6}));
  const Polygon3 reversed(kRectangle.rbegin(), kRectangle.rend());
  EXPECT_EQ(AreaVector(reversed), (Vec3{0, 0, -6}));
  EXPECT_EQ(PolygonArea(reversed), 6);
}

TEST(PlanarPolygon, LessThanATriangleHasNoArea) {
  EXPECT_EQ(PolygonArea({}), 0);
  EXPECT_EQ(PolygonArea(Polygon3{{0, 0, 0}, {1, 0, 0}}), 0);
}

TEST(PlanarPolygon, TotalAreaAddsUp) {
  const std::vector<Polygon3> polygons(3, kRectangle);
  EXPECT_EQ(TotalArea(polygons), 18);
  EXPECT_EQ(TotalArea({}), 0);
}

TEST(PlanarPolygon, ThicknessOfARectangleIsTwiceItsShortSide) {
  EXPECT_EQ(Thickness(kRectangle), 4);
}

TEST(PlanarPolygon, ThicknessOfATriangleIsItsHeightOverTheLongestSide) {
  EXPECT_NEAR(
      Thickness(Polygon3{{0, 0, 0}, {5, 0, 0}, {1, 0.5, 0}}), 0.5, 1e-15);
}

TEST(PlanarPolygon, PointsOnALineHaveNoThickness) {
  EXPECT_EQ(Thickness(Polygon3{{0, 0, 0}, {1, 0, 0}, {3, 0, 0}}), 0);
  EXPECT_EQ(Thickness(Polygon3(3, Point3{1, 2, 3})), 0);
}

TEST(PlanarPolygon, VertexMeanIsTheMiddleOfARectangle) {
  EXPECT_EQ(VertexMean(kRectangle), (Point3{2.5, 2, 5}));
}

TEST(PlanarPolygon, RangeAlongAnAxisIsMeasuredFromTheOrigin) {
  const AxisRange range = RangeAlong(kRectangle, {-1, 0, 0});
  EXPECT_EQ(range.low, -4);
  EXPECT_EQ(range.high, -1);
}

}  // namespace
}  // namespace enfilade
