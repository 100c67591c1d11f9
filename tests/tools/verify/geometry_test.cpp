// The kernel and the directions that verify samples light with.

#include "tools/verify/geometry.h"

#include "base/photometry.h"
#include "base/random.h"

#include <cmath>

#include <gtest/gtest.h>

namespace enfilade {
namespace {

constexpr double kRounding = 1e-15;

TEST(Frame, IsRightHandedAboutAnyNormal) {
  Random random(1);
  for (int i = 0; i < 100; ++i) {
    const double z = i < 2 ? 2 * i - 1 : 2 * random.Next() - 1;
    const double r = std::sqrt(1 - z * z);
    const double phi = 2 * kPi * random.Next();
    const Vec3 n{r * std::cos(phi), r * std::sin(phi), z};
    Vec3 s;
    Vec3 t;
    MakeFrame(n, &s, &t);
    EXPECT_NEAR(Length(s), 1, 8 * kRounding);
    EXPECT_NEAR(Length(Cross(s, t) - n), 0, 8 * kRounding);
  }
}

// Of a density proportional to the cosine, the mean of the cosine is 2/3 and
// that of its square 1/2.
TEST(CosineDirection, HasTheMeanOfItsDensity) {
  const Vec3 normal = Normalize(Vec3{1, 2, -2});
  Random random(2);
  constexpr int kCount = 10000;
  double sum = 0;
  for (int i = 0; i < kCount; ++i) {
    const double u = random.Next();
    sum += Dot(CosineDirection(normal, u, random.Next()), normal);
  }
  EXPECT_NEAR(sum / kCount, 2.0 / 3, 5 * std::sqrt((0.5 - 4.0 / 9) / kCount));
}

TEST(GeometryTerm, IsThatOfPointsFaceToFace) {
  const Point3 x{0, 0, 0};
  const Point3 y{0, 0, 2};
  EXPECT_NEAR(GeometryTerm(x, {0, 0, 1}, y, {0, 0, -1}), 1 / (4 * kPi), 1e-15);
}

TEST(GeometryTerm, IsTheSameBothWays) {
  const Point3 x{0, 0, 0};
  const Point3 y{1, 2, 3};
  const Vec3 n = Normalize(Vec3{1, 0, 1});
  const Vec3 m = Normalize(Vec3{0, -1, -2});
  EXPECT_NEAR(GeometryTerm(x, n, y, m), GeometryTerm(y, m, x, n), 1e-16);
}

TEST(GeometryTerm, IsZeroBehindEitherPoint) {
  const Point3 x{0, 0, 0};
  const Point3 y{0, 0, 2};
  EXPECT_EQ(GeometryTerm(x, {0, 0, -1}, y, {0, 0, -1}), 0);
  EXPECT_EQ(GeometryTerm(x, {0, 0, 1}, y, {0, 0, 1}), 0);
  EXPECT_EQ(GeometryTerm(x, {0, 0, 1}, x, {0, 0, -1}), 0);
}

}  // namespace
}  // namespace enfilade
