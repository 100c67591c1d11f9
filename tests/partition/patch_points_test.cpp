#include "partition/patch_points.h"

#include <gtest/gtest.h>

namespace enfilade {
namespace {

Patch PatchOf(PatchShape shape) {
  Patch p;
  p.origin = {1, 2, 3};
  p.u = {4, 0, 0};
  p.v = {1, 2, 0};
  p.shape = shape;
  return p;
}

TEST(PatchPoints, CornersRunCounterClockwise) {
  const auto corners = CornersOf(PatchOf(PatchShape::kParallelogram));
  const std::array<Point3, 4> expected = {
      {{1, 2, 3}, {5, 2, 3}, {6, 4, 3}, {2, 4, 3}}};
  EXPECT_EQ(corners.count, 4U);
  EXPECT_EQ(corners.points, expected);
}

TEST(PatchPoints, TriangleHasThreeCorners) {
  const auto corners = CornersOf(PatchOf(PatchShape::kTriangle));
  ASSERT_EQ(corners.View().size(), 3U);
  EXPECT_EQ(corners.View()[1], (Point3{5, 2, 3}));
  EXPECT_EQ(corners.View()[2], (Point3{2, 4, 3}));
}

TEST(PatchPoints, PointOnHasItsCoordinates) {
  const Patch p = PatchOf(PatchShape::kParallelogram);
  EXPECT_EQ(PointOn(p, 0.25, 0.5), (Point3{2.5, 3, 3}));
}

TEST(PatchPoints, CentroidIsTheMeanOfTheCorners) {
  for (const PatchShape shape :
       {PatchShape::kParallelogram, PatchShape::kTriangle}) {
    const Patch p = PatchOf(shape);
    const auto corners = CornersOf(p);
    Vec3 sum;
    for (const Point3 corner : corners.View()) {
      sum = sum + (corner - Point3{});
    }
    const Point3 mean = Point3{} + sum / static_cast<double>(corners.count);
    EXPECT_NEAR(Length(Centroid(p) - mean), 0, 1e-14);
  }
}

TEST(PatchPoints, NothingIsFoldedOnAParallelogram) {
  EXPECT_EQ(FoldedOnto(PatchShape::kParallelogram, 0.75, 0.5),
            std::pair(0.75, 0.5));
}

TEST(PatchPoints, WhatIsBeyondTheLongSideOfATriangleIsFoldedBack) {
  EXPECT_EQ(FoldedOnto(PatchShape::kTriangle, 0.25, 0.5), std::pair(0.25, 0.5));
  EXPECT_EQ(FoldedOnto(PatchShape::kTriangle, 0.75F, 0.5F),
            std::pair(0.25F, 0.5F));
}

}  // namespace
}  // namespace enfilade
