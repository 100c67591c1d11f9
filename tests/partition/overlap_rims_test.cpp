// What stands on a surface that was put in front of another begins there.

#include "partition/overlap_rims.h"

#include "partition/overlap.h"
#include "partition/patch_cutter.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "tests/partition/test_scenes.h"
#include <gtest/gtest.h>

namespace enfilade {
namespace {

using testing::Separate;

constexpr uint32_t kGround = 0;
constexpr uint32_t kPlate = 1;
constexpr uint32_t kStanding = 2;

Patch RimPatch(uint32_t face, Point3 origin, Vec3 u, Vec3 v) {
  Patch p;
  p.origin = origin;
  p.u = u;
  p.v = v;
  p.face = FaceId(face);
  p.material = MaterialId(face);
  return p;
}

// A floor, and a plate of 1 m in its plane.
std::vector<Patch> FloorAndPlate() {
  return {RimPatch(kGround, {-5, -5, 0}, {10, 0, 0}, {0, 10, 0}),
          RimPatch(kPlate, {0, 0, 0}, {1, 0, 0}, {0, 1, 0})};
}

// A wall of 0.5 m that stands on the line y = 0 and faces +y.
Patch WallFrom(double from_x, double to_x) {
  return RimPatch(kStanding, {to_x, 0, 0}, {from_x - to_x, 0, 0}, {0, 0, 0.5});
}

// The heights of a patch above the floor.
std::pair<double, double> HeightsOf(const Patch& patch) {
  double low = 1e9;
  double high = -1e9;
  for (const Point3 corner : PolygonOf(patch)) {
    low = std::min(low, corner.z);
    high = std::max(high, corner.z);
  }
  return {low, high};
}

// The patches of the wall after overlaps are separated.
std::vector<Patch> WallsAmong(std::vector<Patch> patches) {
  Separate(patches);
  std::erase_if(patches,
                [](const Patch& p) { return p.face.value != kStanding; });
  return patches;
}

TEST(OverlapRims, AWallThatFacesTheSurfaceBeginsAtIt) {
  auto patches = FloorAndPlate();
  patches.push_back(WallFrom(0, 1));
  const auto walls = WallsAmong(patches);
  ASSERT_EQ(walls.size(), 1U);
  const auto [low, high] = HeightsOf(walls[0]);
  EXPECT_NEAR(low, kApartM, 1e-12);
  EXPECT_NEAR(high, 0.5, 1e-12);
  EXPECT_NEAR(PatchArea(walls[0]), 0.5 - kApartM, 1e-12);
}

TEST(OverlapRims, WhateverEdgeItStandsOn) {
  const Patch wall = WallFrom(0, 1);
  const std::vector<Patch> alike = {
      wall,
      RimPatch(kStanding, wall.origin + wall.u, wall.v, -wall.u),
      RimPatch(kStanding, wall.origin + wall.u + wall.v, -wall.u, -wall.v),
      RimPatch(kStanding, wall.origin + wall.v, -wall.v, wall.u)};
  for (Patch turned : alike) {
    for (const PatchShape shape :
         {PatchShape::kParallelogram, PatchShape::kTriangle}) {
      turned.shape = shape;
      const Polygon corners = PolygonOf(turned);
      const auto below = std::count_if(
          corners.begin(), corners.end(), [](Point3 p) { return p.z < 1e-9; });
      auto patches = FloorAndPlate();
      patches.push_back(turned);
      const auto walls = WallsAmong(patches);
      ASSERT_EQ(walls.size(), 1U);
      // A triangle that stands on a corner is left as it is.
      EXPECT_NEAR(HeightsOf(walls[0]).first, below == 2 ? kApartM : 0, 1e-12);
      EXPECT_GT(Dot(PatchNormal(walls[0]), PatchNormal(wall)), 0.999);
    }
  }
}

// Otherwise there would be a crack below the wall where no plate is.
TEST(OverlapRims, OnlyWhereTheSurfaceCoversTheWholeEdge) {
  auto patches = FloorAndPlate();
  patches.push_back(WallFrom(0, 1.5));
  EXPECT_EQ(HeightsOf(WallsAmong(patches).at(0)).first, 0);
  // Two plates cover the edge together.
  patches.push_back(RimPatch(3, {1, 0, 0}, {1, 0, 0}, {0, 1, 0}));
  EXPECT_NEAR(HeightsOf(WallsAmong(patches).at(0)).first, kApartM, 1e-12);
}

TEST(OverlapRims, NotOnTheFarSideNorInFrontOfNothing) {
  auto patches = FloorAndPlate();
  Patch outside = WallFrom(0, 1);
  std::swap(outside.u, outside.v);
  patches.push_back(outside);
  EXPECT_EQ(HeightsOf(WallsAmong(patches).at(0)).first, 0) << "faces away";
  EXPECT_EQ(HeightsOf(WallsAmong({patches[0], WallFrom(0, 1)}).at(0)).first, 0)
      << "nothing was moved";
}

// The two sides of a wall are one blocker to rays only as long as they are
// alike.
TEST(OverlapRims, SidesThatDifferBlockEachByItself) {
  auto patches = FloorAndPlate();
  patches.push_back(WallFrom(0, 1));
  Patch back = WallFrom(0, 1);
  std::swap(back.u, back.v);
  back.is_back = true;
  back.is_twin = true;
  patches.push_back(back);
  for (const Patch& side : WallsAmong(patches)) {
    EXPECT_FALSE(side.is_twin);
  }
}

}  // namespace
}  // namespace enfilade
