// The bound of a transfer before anything is known of it: a transfer whose
// bound is zero brings no light.

#include "base/random.h"
#include "solver/transfer/oracle.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <gtest/gtest.h>

namespace enfilade {
namespace {

Vec3 RandomVector(Random* random) {
  const double x = 2 * random->Next() - 1;
  const double y = 2 * random->Next() - 1;
  return {x, y, 2 * random->Next() - 1};
}

Point3 Origin() {
  return {0, 0, 0};
}

PatchGeometry MakePatch(PatchShape shape, Point3 origin, Vec3 u, Vec3 v) {
  Patch patch;
  patch.shape = shape;
  patch.origin = origin;
  patch.u = u;
  patch.v = v;
  return MakePatchGeometry(patch, Material{}, Origin());
}

// A patch of any proportions; every other one is up to fifty times as long as
// wide.
PatchGeometry RandomPatch(PatchShape shape, Random* random) {
  const Point3 origin = Origin() + RandomVector(random) * 3;
  const Vec3 u = RandomVector(random);
  const double share = random->Next() < 0.5 ? 1 : 0.02;
  const Vec3 v = u * random->Next() + RandomVector(random) * share;
  return MakePatch(shape, origin, u, v);
}

Vec3f RandomPointOn(const PatchGeometry& patch, Random* random) {
  auto s = static_cast<float>(random->Next());
  auto t = static_cast<float>(random->Next());
  if (patch.shape == PatchShape::kTriangle && s + t > 1) {
    s = 1 - s;
    t = 1 - t;
  }
  return PointOn(patch, {}, s, t);
}

// The largest form factor of some points and all corners of the receiver, a
// little off its rim, among those in front of the source, which sends nothing
// backwards.
float LargestFormFactor(const PatchGeometry& receiver,
                        const PatchGeometry& source,
                        Random* random) {
  constexpr int kPoints = 32;
  const Corners polygon = CornersOf(source, {});
  float largest = 0;
  const auto look_from = [&](Vec3f x) {
    if (Dot(x - source.origin, source.normal) > 0) {
      largest =
          std::max(largest, PointToPolygon(x, receiver.normal, polygon.View()));
    }
  };
  for (int i = 0; i < kPoints; ++i) {
    look_from(RandomPointOn(receiver, random));
  }
  const Vec3f center = MakeTransferEnd(receiver, {}).center;
  const Corners corners = CornersOf(receiver, {});
  for (const Vec3f corner : corners.View()) {
    look_from(corner + (center - corner) * 0.001F);
  }
  return largest;
}

// The single-precision error of angles, some 1e-7 for each of four edges.
constexpr float kFormFactorRounding = 2e-6F;

TEST(FormFactorBound, IsNoLessThanAnyFormFactor) {
  Random random(1);
  for (int i = 0; i < 20'000; ++i) {
    const auto shape = [&] {
      return random.Next() < 0.5 ? PatchShape::kTriangle
                                 : PatchShape::kParallelogram;
    };
    const PatchGeometry receiver = RandomPatch(shape(), &random);
    const PatchGeometry source = RandomPatch(shape(), &random);
    const TransferEnd r = MakeTransferEnd(receiver, {});
    const TransferEnd s = MakeTransferEnd(source, {});
    if (IsBehind(r, source)) {
      continue;  // not asked for
    }
    ASSERT_GE(FormFactorBound(r, s) + kFormFactorRounding,
              LargestFormFactor(receiver, source, &random))
        << "pair " << i;
  }
}

// The centroid of a thin triangle is two thirds of its length from its tip.
TEST(FormFactorBound, KnowsHowFarTheTipOfATriangleIs) {
  const PatchGeometry lamp = MakePatch(
      PatchShape::kParallelogram, {-0.5, -0.5, 0}, {1, 0, 0}, {0, 1, 0});
  // The blade is three metres long and upright, 3 m beside the lamp; its tip
  // alone is above the plane of the lamp.
  const PatchGeometry blade = MakePatch(
      PatchShape::kTriangle, {3, 0, 0.4}, {0, 0.02, -3}, {0, -0.02, -3});
  const TransferEnd r = MakeTransferEnd(blade, {});
  const TransferEnd s = MakeTransferEnd(lamp, {});
  ASSERT_FALSE(IsBehind(r, lamp));
  EXPECT_GT(FormFactorBound(r, s), 0);
  EXPECT_GT(FormFactorBound(s, r), 0);
}

// A skirting board 10 m away stands at the floor's horizon, however long the
// piece of floor is: only the height of the board is seen.
TEST(FormFactorBound, OnlyTheOtherElementsHeightCounts) {
  const PatchGeometry wall = MakePatch(
      PatchShape::kParallelogram, {0, -2, 0}, {0, 4, 0}, {0, 0, 0.1F});
  const PatchGeometry floor = MakePatch(
      PatchShape::kParallelogram, {9.9F, -2, 0}, {0.1F, 0, 0}, {0, 4, 0});
  const TransferEnd r = MakeTransferEnd(floor, {});
  const TransferEnd s = MakeTransferEnd(wall, {});
  // The wall has 0.4 m2, is at most 0.1 m above the floor and is no nearer than
  // the gap between the spheres around both.
  const float gap = Length(s.center - r.center) - (r.radius + s.radius);
  EXPECT_LE(FormFactorBound(r, s),
            0.4F * (0.1F / gap) / (3.14159F * gap * gap) * 1.0001F);
  EXPECT_GT(FormFactorBound(r, s), 0);
}

TEST(FormFactorBound, EveryPointIsWithinTheRadius) {
  Random random(2);
  for (size_t i = 0; i < 1'000; ++i) {
    const PatchGeometry patch = RandomPatch(
        i % 2 == 0 ? PatchShape::kTriangle : PatchShape::kParallelogram,
        &random);
    const ElementFrame child = ChildOf({}, patch.shape, i % 4);
    const TransferEnd end = MakeTransferEnd(patch, child);
    float farthest = 0;
    const Corners corners = CornersOf(patch, child);
    for (const Vec3f corner : corners.View()) {
      farthest = std::max(farthest, Length(corner - end.center));
    }
    EXPECT_NEAR(farthest, end.radius, 1e-5F * (1 + end.radius));
  }
}

}  // namespace
}  // namespace enfilade
