#include "base/winding_number.h"

#include <vector>

#include <gtest/gtest.h>

namespace enfilade {
namespace {

// Facing outwards.
std::vector<Triangle3> Tetrahedron() {
  const Point3 o{0, 0, 0};
  const Point3 x{1, 0, 0};
  const Point3 y{0, 1, 0};
  const Point3 z{0, 0, 1};
  return {{o, y, x}, {o, x, z}, {o, z, y}, {x, y, z}};
}

TEST(SolidAngle, OfAnOctantIsAnEighthOfASphere) {
  const Vec3 x = {2, 0, 0};
  const Vec3 y = {0, 3, 0};
  const Vec3 z = {0, 0, 5};
  EXPECT_NEAR(SolidAngle(x, y, z), kPi / 2, 1e-15);
  EXPECT_NEAR(SolidAngle(x, z, y), -kPi / 2, 1e-15);
}

TEST(WindingNumber, IsOneInsideAndZeroOutside) {
  EXPECT_NEAR(WindingNumber(Tetrahedron(), {0.1, 0.2, 0.3}), 1, 1e-14);
  EXPECT_NEAR(WindingNumber(Tetrahedron(), {0.5, 0.6, 0.7}), 0, 1e-14);
}

TEST(WindingNumber, OfASurfaceThatFacesInwardsIsNegative) {
  std::vector<Triangle3> surface = Tetrahedron();
  for (Triangle3& t : surface) {
    t = {t.a, t.c, t.b};
  }
  EXPECT_NEAR(WindingNumber(surface, {0.1, 0.2, 0.3}), -1, 1e-14);
}

TEST(WindingNumber, OfAnOpenSurfaceIsInBetween) {
  std::vector<Triangle3> surface = Tetrahedron();
  surface.pop_back();
  const double inside = WindingNumber(surface, {0.1, 0.1, 0.1});
  EXPECT_GT(inside, 0.5);
  EXPECT_LT(inside, 1);
}

}  // namespace
}  // namespace enfilade
