// The shadow of a blocker is where segments to the light are cut.

#include "solver/transfer/cast_shadow.h"

#include "base/random.h"

#include <algorithm>
#include <cmath>

#include "tests/solver/test_cells.h"
#include <gtest/gtest.h>

namespace enfilade {
namespace {

using test::RandomPatch;
using test::RandomPointOn;

constexpr int kShadowPoints = 4000;

// The share as a number.
double ShareOf(const CastShadow& shadow, const PatchGeometry& blocker) {
  const Corners corners = CornersOf(blocker, {});
  return static_cast<double>(shadow.ShareOf(corners.View())) /
         CastShadow::kWhole;
}

bool Cuts(const PatchGeometry& blocker, Vec3f from, Vec3f to) {
  const float a = Dot(from - blocker.origin, blocker.normal);
  const float b = Dot(to - blocker.origin, blocker.normal);
  if ((a > 0) == (b > 0)) {
    return false;
  }
  const Vec3f d = from + (to - from) * (a / (a - b)) - blocker.origin;
  const Vec3f cross = Cross(blocker.u, blocker.v);
  const float square = Dot(cross, cross);
  const float s = Dot(Cross(d, blocker.v), cross) / square;
  const float t = Dot(Cross(blocker.u, d), cross) / square;
  return blocker.shape == PatchShape::kTriangle
             ? s >= 0 && t >= 0 && s + t <= 1
             : s >= 0 && t >= 0 && s <= 1 && t <= 1;
}

TEST(CastShadow, IsWhereSegmentsToTheLightAreCut) {
  Random random(5);
  int shaded = 0;
  for (int i = 0; i < 400; ++i) {
    auto patches = test::GeometryOf(
        {RandomPatch(random, 0.2, 1), RandomPatch(random, 1, 1)});
    // Any child of any child.
    const PatchShape shape = patches[0].shape;
    ElementFrame frame;
    for (int level = 0; level < 2; ++level) {
      frame = ChildOf(frame, shape, random.NextBelow(kChildren));
    }
    const TransferEnd receiver = MakeTransferEnd(patches[0], frame);
    Vec3f towards = ToFloat(RandomDirection(random));
    if (Dot(towards, patches[0].normal) < 0) {
      towards = towards * -1.0F;
    }
    const Vec3f light = receiver.center + towards * 2.0F;
    if (Dot(towards, patches[0].normal) < 0.2F) {
      continue;  // what is left of the blocker below the light is a matter of 2
                 // %
    }
    // The blocker lies somewhere between the receiver and the light.
    PatchGeometry& blocker = patches[1];
    blocker.origin =
        receiver.center + towards * static_cast<float>(2 * random.Next()) -
        (blocker.u + blocker.v) * static_cast<float>(random.Next());
    const auto reaches_light = [&](Vec3f corner) {
      const Vec3f n = patches[0].normal;
      return Dot(corner - light, n) > -0.1F * Dot(towards, n);
    };
    const Corners corners = CornersOf(blocker, {});
    if (std::any_of(
            corners.View().begin(), corners.View().end(), reaches_light)) {
      continue;
    }
    int cut = 0;
    for (int k = 0; k < kShadowPoints; ++k) {
      cut += Cuts(patches[1], RandomPointOn(patches[0], frame, random), light)
                 ? 1
                 : 0;
    }
    const double share = ShareOf(CastShadow(receiver, light), patches[1]);
    const double seen = static_cast<double>(cut) / kShadowPoints;
    // The shadow leaves out the parts of the blocker within 0.1 mm of the
    // receiver's plane and close to the light.
    EXPECT_NEAR(
        share, seen, 5 * std::sqrt(share * (1 - share) / kShadowPoints) + 5e-3)
        << i;
    shaded += share > 0.01 && share < 0.99 ? 1 : 0;
  }
  EXPECT_GT(shaded, 50);  // or nothing was tested
}

TEST(CastShadow, NothingInThePlaneBehindItOrBeyondTheLightCastsOne) {
  const auto patches = test::GeometryOf({
      test::RandomPatches(1, 1, 1, 1)[0],
  });
  const PatchGeometry& floor = patches[0];
  const TransferEnd receiver = MakeTransferEnd(floor, {});
  const Vec3f light = receiver.center + floor.normal;
  const auto moved = [&](float by) {
    PatchGeometry plate = floor;
    plate.origin = floor.origin + floor.normal * by;
    return ShareOf(CastShadow(receiver, light), plate);
  };
  EXPECT_EQ(moved(0), 0);
  EXPECT_EQ(moved(-0.1F), 0);
  EXPECT_EQ(moved(1), 0);
  EXPECT_EQ(moved(1.5F), 0);
  EXPECT_NEAR(moved(0.5F), 1, 1e-3);
  EXPECT_EQ(
      ShareOf(CastShadow(receiver, receiver.center - floor.normal), floor), 0);
}

}  // namespace
}  // namespace enfilade
