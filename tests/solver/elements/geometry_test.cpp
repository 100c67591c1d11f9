#include "solver/elements/geometry.h"

#include <gtest/gtest.h>

namespace enfilade {
namespace {

PatchGeometry GeometryOfShape(PatchShape shape) {
  Patch patch;
  patch.origin = {1, 2, 3};
  patch.u = {4, 0, 0};
  patch.v = {1, 2, 0};
  patch.shape = shape;
  return MakePatchGeometry(patch, Material{}, Point3{});
}

TEST(UnitShape, CornersAreThoseOfElements) {
  for (const PatchShape shape :
       {PatchShape::kParallelogram, PatchShape::kTriangle}) {
    const PatchGeometry patch = GeometryOfShape(shape);
    const Corners corners = CornersOf(patch, {});
    ASSERT_EQ(corners.count, CornerCount(shape));
    for (size_t k = 0; k < corners.count; ++k) {
      const UnitPoint unit = UnitCorner(shape, k);
      const Vec3f p = PointOn(
          patch, {}, static_cast<float>(unit.a), static_cast<float>(unit.b));
      EXPECT_EQ(Length(corners.points.at(k) - p), 0);
    }
  }
}

TEST(UnitShape, CentroidIsTheMeanOfTheCorners) {
  for (const PatchShape shape :
       {PatchShape::kParallelogram, PatchShape::kTriangle}) {
    UnitPoint sum;
    for (size_t k = 0; k < CornerCount(shape); ++k) {
      sum.a += UnitCorner(shape, k).a;
      sum.b += UnitCorner(shape, k).b;
    }
    const auto count = static_cast<double>(CornerCount(shape));
    EXPECT_EQ(UnitCentroid(shape).a, sum.a / count);
    EXPECT_EQ(UnitCentroid(shape).b, sum.b / count);
  }
}

TEST(PatchAxes, AreRightHandedAlongU) {
  const PatchAxes axes = AxesOf(GeometryOfShape(PatchShape::kParallelogram));
  EXPECT_EQ(Length(axes.x - Vec3f{1, 0, 0}), 0);
  EXPECT_EQ(Length(axes.y - Vec3f{0, 1, 0}), 0);
  EXPECT_EQ(Length(axes.z - Vec3f{0, 0, 1}), 0);
}

TEST(Vec3f, IsIndexedByAxis) {
  const Vec3f v{4, 5, 6};
  EXPECT_EQ(v[0], 4);
  EXPECT_EQ(v[1], 5);
  EXPECT_EQ(v[2], 6);
}

}  // namespace
}  // namespace enfilade
