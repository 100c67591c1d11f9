#include "base/vec.h"

#include "base/random.h"

#include <gtest/gtest.h>

namespace enfilade {
namespace {

Box3 RandomBox(Random* random) {
  const auto point = [&] {
    const double x = random->Next();
    const double y = random->Next();
    return Point3{x, y, random->Next()};
  };
  Box3 box;
  box.Include(point());
  box.Include(Lerp(point(), box.low, 0.5));
  return box;
}

Point3 RandomPointIn(const Box3& box, Random* random) {
  const Vec3 e = box.Extent();
  const double x = random->Next();
  const double y = random->Next();
  return box.low + Vec3{e.x * x, e.y * y, e.z * random->Next()};
}

// A box through which a segment between two boxes passes meets their hull.
TEST(MeetsHull, WhereASegmentPasses) {
  Random random(11);
  int met = 0;
  int passed = 0;
  for (int i = 0; i < 400; ++i) {
    const Box3 a = RandomBox(&random);
    const Box3 b = RandomBox(&random);
    const Box3 box = RandomBox(&random);
    bool passes = false;
    for (int k = 0; k < 20000 && !passes; ++k) {
      const Point3 p = RandomPointIn(a, &random);
      passes = box.Contains(Lerp(p, RandomPointIn(b, &random), random.Next()));
    }
    const bool meets = MeetsHull(box, a, b);
    EXPECT_TRUE(meets || !passes) << i;
    met += meets ? 1 : 0;
    passed += passes ? 1 : 0;
  }
  // Random points miss some boxes that meet the hull only at a corner.
  EXPECT_GT(passed, met / 2);
  EXPECT_GT(met, 40);
  EXPECT_LT(met, 200);
}

TEST(MeetsHull, NotBesideADiagonal) {
  const auto cube = [](double at_x, double at_y) {
    Box3 box;
    box.Include(Point3{at_x, at_y, 0});
    box.Include(Point3{at_x + 1, at_y + 1, 1});
    return box;
  };
  EXPECT_TRUE(MeetsHull(cube(2, 2), cube(0, 0), cube(4, 4)));
  EXPECT_TRUE(MeetsHull(cube(3, 2), cube(0, 0), cube(4, 4)));
  EXPECT_FALSE(MeetsHull(cube(3.1, 1), cube(0, 0), cube(4, 4)));
  EXPECT_FALSE(MeetsHull(cube(4, 0), cube(0, 0), cube(4, 4)));
}

}  // namespace
}  // namespace enfilade
