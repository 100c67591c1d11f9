#include "base/directions.h"

#include <gtest/gtest.h>

namespace enfilade {
namespace {

constexpr double kRounding = 1e-14;

void ExpectRightHanded(const NormalAxes& axes) {
  EXPECT_NEAR(Length(axes.u), 1, kRounding);
  EXPECT_NEAR(Length(axes.v), 1, kRounding);
  EXPECT_NEAR(Dot(axes.u, axes.v), 0, kRounding);
  EXPECT_NEAR(Length(Cross(axes.u, axes.v) - axes.normal), 0, kRounding);
}

TEST(NormalAxes, AreRightHandedAboutAnyNormal) {
  Random random(1);
  for (int i = 0; i < 100; ++i) {
    const Vec3 normal = RandomDirection(random);
    const NormalAxes axes = AxesAbout(normal);
    EXPECT_EQ(axes.normal, normal);
    ExpectRightHanded(axes);
  }
  ExpectRightHanded(AxesAbout({1, 0, 0}));
  ExpectRightHanded(AxesAbout({0, -1, 0}));
}

TEST(NormalAxes, FirstOneLiesAlongTheVectorThatIsGiven) {
  const NormalAxes axes = AxesAbout({0, 0, 1}, {0, 3, 0});
  EXPECT_EQ(axes.u, (Vec3{0, 1, 0}));
  ExpectRightHanded(axes);
}

TEST(NormalAxes, DirectionHasItsAngles) {
  const NormalAxes axes = AxesAbout({0, 0, 1}, {1, 0, 0});
  const Vec3 d = axes.Direction(0.6, 0.8, kPi / 2);
  EXPECT_NEAR(Length(d - Vec3{0, 0.8, 0.6}), 0, kRounding);
}

// The mean of the cosine is 2/3, its variance 1/2 - 4/9; the bound is five
// deviations.
TEST(NormalAxes, CosineDirectionsHaveTheirMean) {
  const NormalAxes axes = AxesAbout(Normalize(Vec3{1, 2, -2}));
  Random random(2);
  constexpr int kCount = 10000;
  double sum = 0;
  for (int i = 0; i < kCount; ++i) {
    const double s = random.Next();
    const Vec3 d = axes.CosineDirection(s, random.Next());
    EXPECT_NEAR(Length(d), 1, 1e-12);
    sum += Dot(d, axes.normal);
  }
  EXPECT_NEAR(sum / kCount, 2.0 / 3, 5 * std::sqrt((0.5 - 4.0 / 9) / kCount));
}

TEST(NormalAxes, CosineDirectionsStayAboveTheHorizon) {
  const NormalAxes axes = AxesAbout({0, 0, 1});
  EXPECT_GT(axes.CosineDirection(1, 0.3).z, 0);
}

TEST(RandomDirection, IsAUnitVector) {
  Random random(3);
  for (int i = 0; i < 100; ++i) {
    EXPECT_NEAR(Length(RandomDirection(random)), 1, kRounding);
  }
}

}  // namespace
}  // namespace enfilade
