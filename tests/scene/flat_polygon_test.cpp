#include "scene/flat_polygon.h"

#include <gtest/gtest.h>

namespace enfilade {
namespace {

constexpr double kNear = 0.01;
constexpr double kRounding = 1e-12;

// An L of two metres in the plane z = 3: the square [0, 2]^2 without [1, 2]^2.
FlatPolygon Angle() {
  return {{{0, 0, 3}, {2, 0, 3}, {2, 1, 3}, {1, 1, 3}, {1, 2, 3}, {0, 2, 3}},
          {{0, 0, 1}, 3}};
}

TEST(NearestOnSegmentTest, IsAnEndBeyondTheEnds) {
  const Point3 a{1, 0, 0};
  const Point3 b{3, 0, 0};
  EXPECT_DOUBLE_EQ(NearestOnSegment({0, 0, 0}, a, b).at, 0);
  EXPECT_DOUBLE_EQ(NearestOnSegment({0, 0, 0}, a, b).distance, 1);
  EXPECT_DOUBLE_EQ(NearestOnSegment({7, 3, 0}, a, b).at, 1);
  EXPECT_DOUBLE_EQ(NearestOnSegment({7, 3, 0}, a, b).distance, 5);
  EXPECT_DOUBLE_EQ(NearestOnSegment({1.5, 2, 0}, a, b).at, 0.25);
  EXPECT_DOUBLE_EQ(NearestOnSegment({1.5, 2, 0}, a, b).distance, 2);
}

TEST(NearestOnSegmentTest, OfAPointIsThatPoint) {
  const Point3 a{1, 0, 0};
  EXPECT_DOUBLE_EQ(NearestOnSegment({1, 2, 0}, a, a).distance, 2);
}

TEST(FlatPolygonTest, IsNearWhatItHoldsAndItsBorder) {
  const FlatPolygon angle = Angle();
  EXPECT_TRUE(angle.IsNear({0.5, 1.5, 3}, kNear));
  EXPECT_TRUE(angle.IsNear({1.5, 1.009, 3}, kNear));
  EXPECT_FALSE(angle.IsNear({1.5, 1.011, 3}, kNear));  // in its notch
  EXPECT_FALSE(angle.IsNear({-0.02, 1, 3}, kNear));
}

// The segments run through both arms, one arm and the notch, one arm alone, and
// the notch alone.
TEST(FlatPolygonTest, LengthIsThatOfThePartsInside) {
  const FlatPolygon angle = Angle();
  EXPECT_NEAR(angle.LengthNear({-3, 0.5, 3}, {5, 0.5, 3}, 0), 2, kRounding);
  EXPECT_NEAR(angle.LengthNear({-3, 1.5, 3}, {5, 1.5, 3}, 0), 1, kRounding);
  EXPECT_NEAR(angle.LengthNear({0.5, -1, 3}, {0.5, 1, 3}, 0), 1, kRounding);
  EXPECT_NEAR(angle.LengthNear({1.5, 1.5, 3}, {5, 1.5, 3}, 0), 0, kRounding);
}

// An edge beside the border that is nearer than the tolerance lies on the
// border along its whole length.
TEST(FlatPolygonTest, LengthAlongTheBorderIsAllOfIt) {
  const FlatPolygon angle = Angle();
  EXPECT_NEAR(
      angle.LengthNear({0, -0.005, 3}, {2, -0.005, 3}, kNear), 2, kRounding);
  EXPECT_NEAR(
      angle.LengthNear({0, -0.02, 3}, {2, -0.02, 3}, kNear), 0, kRounding);
}

}  // namespace
}  // namespace enfilade
