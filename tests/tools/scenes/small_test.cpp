// The seven scenes of the 1997 study and the furnace.

#include "base/error.h"
#include "base/planar_polygon.h"

#include <algorithm>
#include <cmath>

#include "tests/tools/scene_obj_text.h"
#include "tools/scenes/chairs.h"
#include "tools/scenes/shapes.h"
#include "tools/scenes/simple.h"
#include <gtest/gtest.h>

namespace enfilade::testing {
namespace {

size_t Emitters(const ReadScene& scene) {
  return static_cast<size_t>(std::count_if(
      scene.polygons.begin(), scene.polygons.end(), [&](const ReadPolygon& p) {
        return scene.exitance.contains(p.material);
      }));
}

std::vector<ReadPolygon> Object(const ReadScene& scene,
                                const std::string& name) {
  std::vector<ReadPolygon> polygons;
  std::copy_if(scene.polygons.begin(),
               scene.polygons.end(),
               std::back_inserter(polygons),
               [&](const ReadPolygon& p) { return p.object == name; });
  return polygons;
}

TEST(SmallScenes, HaveThePolygonsOfTheStudy) {
  EXPECT_EQ(Generate(WriteParallel, {}).polygons.size(), 2U);
  EXPECT_EQ(Generate(WritePerpendicular, {}).polygons.size(), 2U);
  EXPECT_EQ(Generate(WriteBlocker, {}).polygons.size(), 3U);
  EXPECT_EQ(Generate(WriteBox, {}).polygons.size(), 9U);
  EXPECT_EQ(Generate(WriteTube, {}).polygons.size(), 5U);
}

TEST(SmallScenes, FacesAreSound) {
  EXPECT_TRUE(AllFacesAreSound(Generate(WriteParallel, {})));
  EXPECT_TRUE(AllFacesAreSound(Generate(WritePerpendicular, {})));
  EXPECT_TRUE(AllFacesAreSound(Generate(WriteBlocker, {})));
  EXPECT_TRUE(AllFacesAreSound(Generate(WriteBox, {})));
  EXPECT_TRUE(AllFacesAreSound(Generate(WriteTube, {})));
}

// Each face of a bulb looks away from its centre.
TEST(SmallScenes, BulbsAreClosedAndLookOutwards) {
  for (const uint32_t n : {2U, 6U}) {
    const ReadScene scene = Generate(WriteBulbs, {n});
    EXPECT_EQ(scene.polygons.size(), 36 + 8 * n * (n - 1));
    EXPECT_TRUE(AllFacesAreSound(scene));
    Vec3 sum{};
    for (const ReadPolygon& p : scene.polygons) {
      if (scene.exitance.contains(p.material)) {
        const Point3 center =
            p.vertices[0].x < 2 ? Point3{1.5, 1.7, 2.2} : Point3{3, 3, 2.2};
        EXPECT_GT(Dot(AreaVector(p.vertices), p.vertices[0] - center), 0);
        sum = sum + AreaVector(p.vertices);
      }
    }
    EXPECT_NEAR(Length(sum), 0, 1e-9) << "closed: its area vectors cancel";
  }
}

// The tubes hang from the ceiling, apart; the lamps are closed and inside them.
TEST(SmallScenes, DownlightsHangFromTheCeiling) {
  for (const uint32_t n : {1U, 7U, 48U}) {
    const ReadScene scene = Generate(WriteDownlights, {n});
    EXPECT_EQ(scene.polygons.size(), 12 + 16 * n);
    EXPECT_TRUE(AllFacesAreSound(scene));
    const auto tubes = Object(scene, "tube");
    const auto lamps = Object(scene, "lamp");
    ASSERT_EQ(tubes.size(), 8 * n);
    ASSERT_EQ(lamps.size(), 8 * n);
    for (size_t i = 0; i < n; ++i) {
      Box3 tube;
      Box3 lamp;
      Vec3 sum{};
      for (size_t k = 8 * i; k < 8 * i + 8; ++k) {
        tube.Include(BoundsOf(tubes[k].vertices));
        lamp.Include(BoundsOf(lamps[k].vertices));
        sum = sum + AreaVector(lamps[k].vertices);
      }
      EXPECT_NEAR(tube.high.z, 2.8, 1e-6);
      EXPECT_NEAR(Length(tube.Extent() - Vec3{0.1, 0.1, 0.1}), 0, 1e-5);
      EXPECT_NEAR(Length(tube.Center() - lamp.Center()), 0, 1e-5);
      EXPECT_NEAR(Length(lamp.Extent() - Vec3{0.04, 0.04, 0.04}), 0, 1e-5);
      EXPECT_NEAR(Length(sum), 0, 1e-9);
    }
  }
}

// Each of the two squares lies in front of the other.
TEST(SmallScenes, TheTwoSquaresFaceEachOther) {
  for (const ReadScene& scene :
       {Generate(WriteParallel, {0.3}), Generate(WritePerpendicular, {0.3})}) {
    for (size_t i = 0; i < 2; ++i) {
      const auto& self = scene.polygons[i].vertices;
      const auto& other = scene.polygons[1 - i].vertices;
      const Vec3 normal = AreaVector(self);
      EXPECT_NEAR(Length(normal), 1, 1e-12);
      EXPECT_GT(Dot(BoundsOf(other).Center() - self[0], normal), 0.1);
    }
  }
}

// 4 sides x (2 x 32) + 2 x 2 patches of edge 0.25, W table 2.
TEST(SmallScenes, TubeHasTheAreaOf260PatchesAndLooksInwards) {
  const ReadScene tube = Generate(WriteTube, {});
  double area = 0;
  for (const ReadPolygon& p : tube.polygons) {
    const Vec3 normal = AreaVector(p.vertices);
    area += Length(normal);
    EXPECT_GT(Dot(Point3{4, 0.25, 0.25} - p.vertices[0], normal), 0);
  }
  EXPECT_NEAR(area, 260 * 0.0625, 1e-9);
}

TEST(SmallScenes, LightOfTheBoxIsInverseToReflectance) {
  const ReadScene dark = Generate(WriteBox, {0.3});
  const ReadScene bright = Generate(WriteBox, {0.9});
  EXPECT_NEAR(dark.exitance.at("light")[0] * 0.3,
              bright.exitance.at("light")[0] * 0.9,
              1e-6);
}

TEST(SmallScenes, ParametersOutOfRangeAreUsageErrors) {
  EXPECT_THROW(Generate(WriteParallel, {0.0}), UsageError);
  EXPECT_THROW(Generate(WritePerpendicular, {-0.1}), UsageError);
  EXPECT_THROW(Generate(WriteBlocker, {2.0}), UsageError);
  EXPECT_THROW(Generate(WriteBox, {0.0}), UsageError);
  EXPECT_THROW(Generate(WriteBulbs, {1}), UsageError);
  EXPECT_THROW(Generate(WriteDownlights, {0}), UsageError);
  EXPECT_THROW(Generate(WriteTube, {1.0}), UsageError);
  EXPECT_THROW(Generate(WriteTube, {std::nan("")}), UsageError);
  EXPECT_THROW(Generate(WriteChairs, {0}), UsageError);
  EXPECT_THROW(Generate(WriteLights, {0}), UsageError);
  EXPECT_THROW(Generate(WriteFurnace, {9, 1.0, 1.0}), UsageError);
  EXPECT_THROW(Generate(WriteFurnace, {9, 0.5, 0.0}), UsageError);
}

TEST(Chairs, CountOfPolygonsIs5Plus27PerChair) {
  for (const uint32_t m : {4U, 6U, 9U, 12U, 16U, 20U, 25U, 30U, 36U}) {
    const ReadScene scene = Generate(WriteChairs, {m});
    EXPECT_EQ(scene.polygons.size(), 5 + 27 * m);
    EXPECT_EQ(Emitters(scene), 1U);
    EXPECT_TRUE(AllFacesAreSound(scene));
  }
}

// A scaled room keeps the areas of floor and walls per chair; a horizontally
// scaled one keeps its height.
TEST(Chairs, RoomGrowsAsTheScalingSays) {
  const auto room = [](uint32_t count, ChairScaling scaling) {
    const ReadScene scene = Generate(WriteChairs, {count, scaling});
    Box3 box;
    for (const ReadPolygon& p : scene.polygons) {
      box.Include(BoundsOf(p.vertices));
    }
    return box.Extent();
  };
  const Vec3 small = room(9, ChairScaling::kBoth);
  const Vec3 large = room(36, ChairScaling::kBoth);
  EXPECT_NEAR(large.x / small.x, 2, 1e-9);
  EXPECT_NEAR(large.y / small.y, 2, 1e-9);
  EXPECT_NEAR(large.z / small.z, 2, 1e-9);
  const Vec3 low = room(9, ChairScaling::kHorizontal);
  const Vec3 wide = room(36, ChairScaling::kHorizontal);
  EXPECT_NEAR(wide.x / low.x, 2, 1e-9);
  EXPECT_NEAR(wide.z, low.z, 1e-9);
  EXPECT_EQ(room(9, ChairScaling::kNone), room(36, ChairScaling::kNone));
  EXPECT_EQ(room(400, ChairScaling::kNone), room(36, ChairScaling::kNone));
}

// Checks that the chairs stand on the room's floor, inside the room and clear
// of each other.
void ExpectChairsApart(const ReadScene& scene, int count, double scale) {
  const auto room = BoundsOf(Object(scene, "floor")[0].vertices);
  std::vector<Point3> centers;
  for (int i = 1; i <= count; ++i) {
    Box3 box;
    for (const ReadPolygon& p : Object(scene, "chair" + std::to_string(i))) {
      box.Include(BoundsOf(p.vertices));
    }
    EXPECT_GT(box.low.x, room.low.x);
    EXPECT_GT(box.low.y, room.low.y);
    EXPECT_LT(box.high.x, room.high.x);
    EXPECT_LT(box.high.y, room.high.y);
    for (const Point3 other : centers) {
      EXPECT_GT(Length(box.Center() - other),
                scale * (2 * kChairRadius - 1e-3));
    }
    centers.push_back(box.Center());
    EXPECT_NEAR(box.low.z, 0, 1e-9);
    EXPECT_NEAR(box.high.z, scale * kChairHeight, 1e-6);
  }
}

TEST(Chairs, StandApartAndInsideTheRoom) {
  ExpectChairsApart(Generate(WriteChairs, {36}), 36, 1);
}

// Each of 20 x 20 chairs on 6 m x 6 m has 0.3 m but needs 0.678 m.
TEST(Chairs, AreSmallerWhereARoomThatDoesNotGrowIsCrowded) {
  ExpectChairsApart(
      Generate(WriteChairs, {400, ChairScaling::kNone}), 400, 0.3 / 0.678);
}

TEST(Lights, CountOfPolygonsIs328PlusLights) {
  for (const uint32_t m : {1U, 4U, 9U, 16U}) {
    const ReadScene scene = Generate(WriteLights, {m});
    EXPECT_EQ(scene.polygons.size(), 328 + m);
    EXPECT_EQ(Emitters(scene), m);
    double area = 0;
    for (const ReadPolygon& p : scene.polygons) {
      area += scene.exitance.contains(p.material) ? PolygonArea(p.vertices) : 0;
    }
    EXPECT_NEAR(area, 0.0625 * 9, 1e-6) << "the lights share one area";
  }
}

TEST(Furnace, EveryFaceEmitsAndReflectsAlike) {
  const ReadScene scene = Generate(WriteFurnace, {9, 0.7, 2.0});
  EXPECT_EQ(scene.polygons.size(), 6 + 33 * 9U);
  EXPECT_EQ(Emitters(scene), scene.polygons.size());
  EXPECT_EQ(scene.reflectance.size(), 1U);
  EXPECT_EQ(scene.exitance.begin()->second, (Rgb{2, 2, 2}));
  EXPECT_TRUE(AllFacesAreSound(scene));
}

// The air is on the emitting side everywhere: the room's faces enclose it (a
// negative solid), a chair's faces enclose the chair.
TEST(Furnace, FrontsFaceTheAir) {
  const ReadScene scene = Generate(WriteFurnace, {9});
  const std::vector<ReadPolygon> room = Object(scene, "room");
  EXPECT_TRUE(EdgesCancel(room));
  EXPECT_NEAR(EnclosedVolume(room), -27, 1e-6);  // 3 x 3 x 3
  // Seat, back and four legs.
  const double chair = 0.45 * 0.45 * 0.04 + 0.45 * 0.03 * 0.45 +
                       4 * 0.04 * 0.04 * (0.41 - kChairFootGap);
  for (int i = 1; i <= 9; ++i) {
    EXPECT_NEAR(EnclosedVolume(Object(scene, "chair" + std::to_string(i))),
                chair,
                1e-7);
  }
}

TEST(Furnace, ChairsAreClosedSurfaces) {
  const TemporaryFolder dir;
  ObjWriter writer(dir.Path() / "chair.obj");
  AddChair(writer, Placement({}, 0), ChairBuild::kClosed);
  writer.Finish();
  EXPECT_TRUE(EdgesCancel(ReadObj(dir.Path() / "chair.obj").polygons));
}

TEST(Seeds, SameSeedSameSceneAndAnotherSeedAnother) {
  const TemporaryFolder dir;
  const auto text = [&](const char* name, uint64_t seed) {
    const auto path = dir.Path() / name;
    ObjWriter writer(path);
    WriteChairs({9, ChairScaling::kBoth, seed}, writer);
    writer.Finish();
    const std::string all = ReadFile(path);
    return all.substr(all.find("\no "));  // after the name of the MTL file
  };
  EXPECT_EQ(text("a.obj", 5), text("b.obj", 5));
  EXPECT_NE(text("a.obj", 5), text("c.obj", 6));
}

}  // namespace
}  // namespace enfilade::testing
