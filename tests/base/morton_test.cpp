#include "base/morton.h"

#include <algorithm>
#include <vector>

#include <gtest/gtest.h>

namespace enfilade {
namespace {

// Points in a corridor of 16 cubes, 64 points in each: the curve leaves no cube
// before it has been at all points in it.
TEST(MortonCode, PartsOfALongBoxAreCompact) {
  constexpr int kCubes = 16;
  constexpr size_t kPointsOfACube = 64;
  const Box3 corridor{{5, -3, 2}, {5 + kCubes, -2, 3}};
  std::vector<Point3> points;
  for (int x = 0; x < 4 * kCubes; ++x) {
    for (int y = 0; y < 4; ++y) {
      for (int z = 0; z < 4; ++z) {
        points.push_back(corridor.low + Vec3{x + 0.5, y + 0.5, z + 0.5} * 0.25);
      }
    }
  }
  std::reverse(points.begin(), points.end());
  std::sort(points.begin(), points.end(), [&](Point3 a, Point3 b) {
    return MortonCode(a, corridor) < MortonCode(b, corridor);
  });
  for (size_t first = 0; first < points.size(); first += kPointsOfACube) {
    Box3 box;
    for (size_t i = first; i < first + kPointsOfACube; ++i) {
      box.Include(points[i]);
    }
    EXPECT_LE(box.Extent().x, 0.75) << first;
  }
}

TEST(MortonCode, PointsOutsideHaveThePlaceOfTheNearestInside) {
  const Box3 box{{0, 0, 0}, {1, 1, 1}};
  EXPECT_EQ(MortonCode({-1, -1, -1}, box), MortonCode({0, 0, 0}, box));
  EXPECT_EQ(MortonCode({2, 2, 2}, box), MortonCode({1, 1, 1}, box));
  EXPECT_EQ(MortonCode({0, 0, 0}, {{0, 0, 0}, {0, 0, 0}}), 0U);
}

}  // namespace
}  // namespace enfilade
