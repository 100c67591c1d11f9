#include "base/plane.h"

#include <gtest/gtest.h>

namespace enfilade {
namespace {

TEST(Plane, DistanceIsPositiveInFront) {
  const Plane plane{{0, 0, 1}, 2};
  EXPECT_EQ(plane.Distance({7, -3, 5}), 3);
  EXPECT_EQ(plane.Distance({7, -3, 2}), 0);
  EXPECT_EQ(plane.Distance({7, -3, 0}), -2);
}

TEST(Plane, FlippedPlaneHasTheSamePointsAndTheOtherFront) {
  const Plane plane{{0.6, 0, 0.8}, 1};
  const Point3 p{3, 4, 5};
  EXPECT_EQ(plane.Flipped().Distance(p), -plane.Distance(p));
}

TEST(SnappedToAxis, NearlyAnAxisIsThatAxis) {
  const Vec3 nearly = Normalize(Vec3{1e-9, -1, 1e-9});
  EXPECT_EQ(SnappedToAxis(nearly, 1e-7), (Vec3{0, -1, 0}));
  EXPECT_EQ(SnappedToAxis(-nearly, 1e-7), (Vec3{0, 1, 0}));
}

TEST(SnappedToAxis, BeyondTheToleranceNothingChanges) {
  const Vec3 unit = Normalize(Vec3{1e-6, 0, 1});
  EXPECT_EQ(SnappedToAxis(unit, 1e-7), unit);
}

}  // namespace
}  // namespace enfilade
