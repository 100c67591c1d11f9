// The inner sides of closed solids are enclosed, unless a lamp is inside.

#include "partition/patch.h"

#include <algorithm>

#include "tests/partition/test_scenes.h"
#include <gtest/gtest.h>

namespace enfilade {
namespace {

using testing::Built;
using testing::SceneBuilder;

constexpr Box3 kCupboard{{1, 1, 0.5}, {2, 1.5, 1.5}};
constexpr MaterialId kLamp{2U};

SceneBuilder RoomWithCupboard() {
  SceneBuilder scene;
  scene.AddBox({{0, 0, 0}, {4, 3, 2.5}});
  scene.AddSolid(kCupboard);
  return scene;
}

double EnclosedArea(const SceneBuilder& scene) {
  const Built built(scene);
  double area = 0;
  for (size_t i = 0; i < built.partition.cells.size(); ++i) {
    const auto patches = LoadCellPatches(*built.store, CellId(i)).patches;
    for (const Patch& p : patches) {
      area += p.is_enclosed ? PatchArea(p) : 0;
    }
  }
  return area;
}

TEST(Enclosed, AreTheInnerSidesOfASolid) {
  const Built built(RoomWithCupboard());
  const CellPatches cell = LoadCellPatches(*built.store, built.At({3, 2, 1}));
  const Point3 middle = kCupboard.Center();
  size_t enclosed = 0;
  for (const Patch& p : cell.patches) {
    const Point3 on = p.origin + (p.u + p.v) * 0.5;
    const bool faces_in =
        Length(on - middle) < 0.8 && Dot(PatchNormal(p), middle - on) > 0;
    EXPECT_EQ(p.is_enclosed, faces_in);
    EXPECT_TRUE(p.reflects);
    enclosed += p.is_enclosed ? 1 : 0;
  }
  EXPECT_EQ(enclosed, 6U);
}

TEST(Enclosed, AreNoneWhereALampIsInside) {
  SceneBuilder scene = RoomWithCupboard();
  scene.Add({2, 1.0, 1.4, 1.2, 1.6, 1.3}, kLamp);
  EXPECT_EQ(EnclosedArea(scene), 0);
}

TEST(Enclosed, AreThoseBehindALampThatHangsOnTheSolid) {
  SceneBuilder scene = RoomWithCupboard();
  scene.Add({2, 1.5, 1.4, 1.2, 1.6, 1.3}, kLamp);
  // The lamp's back and the part of the solid that the lamp hides are enclosed
  // too.
  const double lamp = 0.2 * 0.1;
  EXPECT_NEAR(EnclosedArea(scene), 4 + 2 * lamp, 1e-9);
}

// A room of one closed surface has a lamp in the plane of its ceiling: only the
// ceiling behind the lamp's two sides is enclosed.
TEST(Enclosed, AreNoneInARoomWithALampInItsCeiling) {
  SceneBuilder scene;
  scene.AddSolid({{0, 0, 0}, {4, 3, 2.5}});
  scene.Add(Polygon{{1, 1, 2.5}, {1, 2, 2.5}, {2, 2, 2.5}, {2, 1, 2.5}}, kLamp);
  EXPECT_NEAR(EnclosedArea(scene), 2, 1e-9);
}

TEST(Enclosed, AreThoseBehindTheSkinOfALamp) {
  SceneBuilder scene;
  scene.AddBox({{0, 0, 0}, {4, 3, 2.5}});
  scene.AddSolid({{1, 1, 1}, {2, 2, 2}}, kLamp);
  EXPECT_NEAR(EnclosedArea(scene), 6, 1e-9);
}

// The solid's bottom hides the floor under it, not the other way round,
// although the bottom is no smaller.
TEST(Enclosed, LieBeforeWhatTheSolidStandsOn) {
  SceneBuilder scene;
  scene.AddBox({{0, 0, 0}, {4, 3, 2.5}});
  scene.AddSolid({{1, 1, 0}, {2, 2, 1}});
  // A mat on the same place.
  scene.Add({2, 0.0, 1.2, 1.2, 1.4, 1.4});
  const Built built(scene);
  const CellPatches cell = LoadCellPatches(*built.store, built.At({3, 2, 1}));
  double highest_open = -1;
  double enclosed = -1;
  for (const Patch& p : cell.patches) {
    if (PatchNormal(p).z > 0.9 && std::abs(p.origin.z) < 0.01) {
      double& height = p.is_enclosed ? enclosed : highest_open;
      height = std::max(height, p.origin.z);
    }
  }
  EXPECT_GT(enclosed, highest_open);
}

}  // namespace
}  // namespace enfilade
