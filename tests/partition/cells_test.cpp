// Cells and portals of small buildings.

#include "base/error.h"
#include "base/photometry.h"
#include "partition/bsp_builder.h"
#include "partition/open_borders.h"
#include "partition/partition.h"
#include "partition/partition_store.h"
#include "scene/box_tree.h"

#include <cmath>

#include "tests/partition/test_scenes.h"
#include <gtest/gtest.h>

namespace enfilade {
namespace {

using testing::Built;
using testing::SceneBuilder;
using testing::TwoRoomsWithDoor;

double Area(const std::vector<Portal>& portals) {
  double area = 0;
  for (const Portal& portal : portals) {
    area += PolygonArea(portal.vertices);
  }
  return area;
}

TEST(Cells, RoomsWithADoorAreTwoCellsJoinedByThatDoor) {
  const Built built(TwoRoomsWithDoor());
  const CellId left = built.At({1, 1, 1});
  const CellId right = built.At({7, 1, 1});
  const CellId outside = built.At({-0.05, 1, 1});
  EXPECT_NE(left, right);
  EXPECT_NE(left, outside);
  const auto portals = built.Between(left, right);
  ASSERT_EQ(portals.size(), 1U);
  const Box3 bounds = BoundsOf(portals[0].vertices);
  EXPECT_NEAR(bounds.low.y, 1.0, 1e-6);
  EXPECT_NEAR(bounds.high.y, 1.9, 1e-6);
  EXPECT_NEAR(bounds.low.z, 0.0, 1e-6);
  EXPECT_NEAR(bounds.high.z, 2.1, 1e-6);
  EXPECT_NEAR(bounds.low.x, 4.0, 1e-9);
  EXPECT_TRUE(built.Between(left, outside).empty());
  EXPECT_EQ(built.partition.cells.size(), 3U);
}

TEST(Cells, PortalFacesTheCellInFrontOfIt) {
  const Built built(TwoRoomsWithDoor());
  EXPECT_FALSE(built.partition.portals.empty());
  for (const Portal& portal : built.partition.portals) {
    const Vec3 normal = Normalize(AreaVector(portal.vertices));
    const Point3 middle = VertexMean(portal.vertices);
    EXPECT_EQ(built.At(middle + normal * 1e-3), portal.front);
    EXPECT_EQ(built.At(middle - normal * 1e-3), portal.back);
  }
}

// Two rooms with a wall of 0.2 m between them, and a doorway through it.
SceneBuilder RoomsWithADoorway() {
  SceneBuilder scene;
  scene.AddBox({{-0.3, -0.3, -0.3}, {8.3, 3.3, 3.0}});
  scene.AddBox({{0, 0, 0}, {8, 3, 2.7}});
  const SceneBuilder::Rectangle door{0, 0, 1, 0, 1.9, 2.1};
  for (const double x : {3.9, 4.1}) {
    scene.AddWithHole({0, x, 0, 0, 3, 2.7}, door);
  }
  scene.Add({1, 1.0, 3.9, 0, 4.1, 2.1});
  scene.Add({1, 1.9, 3.9, 0, 4.1, 2.1});
  scene.Add({2, 2.1, 3.9, 1, 4.1, 1.9});
  return scene;
}

TEST(Cells, ThickWallsWithADoorwayKeepTheRoomsApart) {
  const SceneBuilder scene = RoomsWithADoorway();
  const Built built(scene);
  const CellId left = built.At({1, 1, 1});
  const CellId right = built.At({7, 1, 1});
  EXPECT_NE(left, right);
  EXPECT_NE(built.At({4, 0.5, 1}), left);
  EXPECT_NE(built.At({4, 0.5, 1}), right);
  // The doorway is a cell of its own or part of one room.
  const CellId doorway = built.At({4, 1.5, 1});
  EXPECT_TRUE(doorway == left || doorway == right ||
              (!built.Between(left, doorway).empty() &&
               !built.Between(doorway, right).empty()));
  const CellId door_side = doorway == right ? right : doorway;
  EXPECT_NEAR(Area(built.Between(left, door_side == left ? right : door_side)),
              0.9 * 2.1,
              1e-6);
}

// The bounding box of a turned wall is as wide as it is long.
TEST(Cells, AreTheSameHoweverTheBuildingIsTurned) {
  const Built upright(RoomsWithADoorway());
  for (const double degrees : {10.0, 30.0, 45.0, 77.0}) {
    SceneBuilder scene = RoomsWithADoorway();
    scene.Turn(degrees * kPi / 180);
    const Built built(scene);
    EXPECT_EQ(built.partition.cells.size(), upright.partition.cells.size())
        << degrees;
    EXPECT_EQ(built.partition.portals.size(), upright.partition.portals.size())
        << degrees;
  }
}

// Otherwise each window beside a facade whose cell is full would become a cell
// of its own.
TEST(Cells, ADoorwayThatAFullRoomCannotTakeGoesToTheOther) {
  for (const bool left_is_full : {true, false}) {
    SceneBuilder scene = RoomsWithADoorway();
    for (int i = 0; i < 40; ++i) {
      const double x = (left_is_full ? 0.1 : 4.3) + 0.4 * (i % 8);
      const double y = 0.2 + 0.5 * (i / 8);
      scene.AddBox({{x, y, 0.1}, {x + 0.1, y + 0.1, 0.2}});
    }
    const Point3 in_full = left_is_full ? Point3{1, 1, 2} : Point3{7, 1, 2};
    const Point3 in_other = left_is_full ? Point3{7, 1, 2} : Point3{1, 1, 2};
    const Point3 in_doorway{4, 1.5, 1};
    const Built roomy(scene);
    const CellId full = roomy.At(in_full);
    // Finds the largest limit under which the room is too full for the doorway.
    // Not all of the room's patches count, so the limit is a few below their
    // number.
    PartitionOptions options;
    options.max_cell_patches = roomy.partition.cells[full.Index()].patches + 1;
    std::unique_ptr<Built> tight;
    do {
      --options.max_cell_patches;
      ASSERT_GT(options.max_cell_patches, 240U) << "that of the boxes alone";
      tight = std::make_unique<Built>(scene, options);
    } while (tight->At(in_doorway) == tight->At(in_full));
    EXPECT_EQ(tight->partition.cells.size(), roomy.partition.cells.size());
    EXPECT_EQ(tight->At(in_doorway), tight->At(in_other)) << left_is_full;
  }
}

TEST(Cells, FurnitureDoesNotSplit) {
  SceneBuilder scene = TwoRoomsWithDoor();
  scene.AddBox({{0.5, 0.5, 0.70}, {2.1, 1.3, 0.74}});  // a table top
  scene.AddBox({{0.5, 2.6, 0}, {1.5, 3.0, 1.9}});      // a cupboard
  scene.AddBox({{6, 1, 0}, {6.5, 1.5, 0.9}});          // a chair
  const Built built(scene);
  EXPECT_EQ(built.At({0.3, 0.3, 0.3}), built.At({3, 2, 2}));
  EXPECT_EQ(built.At({1, 1, 0.5}), built.At({1, 1, 1.5}));
  EXPECT_EQ(built.At({5, 0.5, 0.2}), built.At({7, 2, 2}));
  EXPECT_EQ(built.partition.cells.size(), 3U);
}

// A hall with so many desks of one height that together they could pass for a
// floor.
SceneBuilder HallOfDesks() {
  SceneBuilder scene;
  scene.AddBox({{0, 0, 0}, {20, 12, 4}});
  for (int i = 0; i < 10; ++i) {
    for (int k = 0; k < 10; ++k) {
      const double x = 0.2 + 1.95 * i;
      const double y = 0.2 + 1.15 * k;
      scene.AddBox({{x, y, 0.70}, {x + 1.6, y + 0.8, 0.74}});
    }
  }
  return scene;
}

TEST(Cells, DesksOfOneHeightAreNoFloor) {
  const Built built(HallOfDesks());
  EXPECT_EQ(built.At({1, 1, 0.3}), built.At({1, 1, 2}));
  EXPECT_EQ(built.partition.cells.size(), 2U);
  EXPECT_TRUE(built.partition.portals.empty());
}

TEST(Cells, DesksPushedTogetherAreNone) {
  SceneBuilder scene;
  scene.AddBox({{0, 0, 0}, {20, 12, 4}});
  for (int i = 0; i < 5; ++i) {
    for (int k = 0; k < 5; ++k) {
      const double x = 0.2 + 3.9 * i;
      const double y = 0.2 + 2.3 * k;
      for (const double dx : {0.0, 1.6}) {
        for (const double dy : {0.0, 0.8}) {
          scene.AddBox(
              {{x + dx, y + dy, 0.70}, {x + dx + 1.6, y + dy + 0.8, 0.74}});
        }
      }
    }
  }
  EXPECT_EQ(Built(scene).partition.cells.size(), 2U);
}

// A gallery along two walls, made of tiles that are smaller than any desk.
TEST(Cells, AGalleryOfTilesIsAFloor) {
  SceneBuilder scene;
  scene.AddBox({{0, 0, 0}, {20, 12, 7}});
  for (int i = 0; i < 20; ++i) {
    for (int k = 0; k < 12; ++k) {
      if (i < 3 || k < 3) {
        scene.Add({2, 3.4, 1.0 * i, 1.0 * k, i + 1.0, k + 1.0});
      }
    }
  }
  const Built built(scene);
  EXPECT_NE(built.At({1, 1, 1}), built.At({1, 1, 5}));
}

SceneBuilder LShapedRoom() {
  SceneBuilder l_shape;
  l_shape.Add({2, 0, 0, 0, 8, 3});
  l_shape.Add({2, 0, 0, 3, 4, 6});
  l_shape.Add({2, 2.7, 0, 0, 8, 3});
  l_shape.Add({2, 2.7, 0, 3, 4, 6});
  l_shape.Add({0, 0, 0, 0, 6, 2.7});
  l_shape.Add({0, 8, 0, 0, 3, 2.7});
  l_shape.Add({0, 4, 3, 0, 6, 2.7});
  l_shape.Add({1, 0, 0, 0, 8, 2.7});
  l_shape.Add({1, 3, 4, 0, 8, 2.7});
  l_shape.Add({1, 6, 0, 0, 4, 2.7});
  return l_shape;
}

TEST(Cells, AnLShapedRoomIsOneCell) {
  const Built built(LShapedRoom());
  EXPECT_EQ(built.At({1, 1, 1}), built.At({7, 1, 1}));
  EXPECT_EQ(built.At({1, 1, 1}), built.At({1, 5, 1}));
  EXPECT_NE(built.At({1, 1, 1}), built.At({7, 5, 1}));
  EXPECT_EQ(built.partition.cells.size(), 2U);
}

TEST(Cells, ARoomOfTooMuchAreaIsSeveralThatAreOpenToEachOther) {
  PartitionOptions options;
  options.max_room_m2 = 120;  // of the 148 m2 of its faces
  const Built built(LShapedRoom(), options);
  EXPECT_EQ(built.partition.cells.size(), 3U);
  const double open_m2 =
      Area(built.Between(built.At({7, 1, 1}), built.At({1, 5, 1})));
  // The corner may go with either wing.
  EXPECT_TRUE(std::abs(open_m2 - 4 * 2.7) < 1e-9 ||
              std::abs(open_m2 - 3 * 2.7) < 1e-9)
      << open_m2;
}

TEST(Cells, TJunctionsLeaveNoOpening) {
  SceneBuilder scene;
  scene.AddBox({{0, 0, 0}, {8, 3, 2.7}});
  // A wall in three unequal pieces that share no corners.
  scene.Add({0, 4, 0, 0, 3, 1});
  scene.Add({0, 4, 0, 1, 1.3, 2.7});
  scene.Add({0, 4, 1.3, 1, 3, 2.7});
  const Built built(scene);
  EXPECT_TRUE(built.Between(built.At({1, 1, 1}), built.At({7, 1, 1})).empty());
}

TEST(Cells, ACrackWiderThanRoundingIsAPortal) {
  SceneBuilder scene;
  scene.AddBox({{0, 0, 0}, {8, 3, 2.7}});
  scene.Add({0, 4, 0, 0, 1.0, 2.7});
  scene.Add({0, 4, 1.0005, 0, 3, 2.7});
  const Built built(scene);
  const auto portals = built.Between(built.At({1, 1, 1}), built.At({7, 1, 1}));
  ASSERT_EQ(portals.size(), 1U);
  EXPECT_NEAR(Area(portals), 0.0005 * 2.7, 1e-8);
}

// Rounding to a step opens cracks beside oblique edges only.
TEST(Subtract, ClosesWiderCracksWhereNoAxisLeadsAcross) {
  constexpr double kSlit = 5e-4;
  const auto left_beside_slit = [](double degrees, double oblique_crack_m) {
    const double angle = degrees * kPi / 180;
    const Vec3 u{std::cos(angle), std::sin(angle), 0};
    const Vec3 v{-std::sin(angle), std::cos(angle), 0};
    const auto rectangle = [&](double from, double to) {
      const Point3 o = Point3{} + u * from;
      return Polygon{o, o + u * (to - from), o + u * (to - from) + v, o + v};
    };
    const Polygon first = rectangle(0, 1);
    const Polygon second = rectangle(1 + kSlit, 2);
    double area = 0;
    for (const Polygon& rest : Subtract(
             rectangle(0, 2), {0, 0, 1}, {&first, &second}, oblique_crack_m)) {
      area += PolygonArea(rest);
    }
    return area;
  };
  EXPECT_NEAR(left_beside_slit(0, 1.5e-3), kSlit, 1e-9);
  EXPECT_NEAR(left_beside_slit(30, kCrackM), kSlit, 1e-9);
  EXPECT_EQ(left_beside_slit(30, 1.5e-3), 0);
}

TEST(Cells, AnEmptySceneIsOneCell) {
  const Built built{SceneBuilder()};
  EXPECT_EQ(built.partition.cells.size(), 1U);
  EXPECT_TRUE(built.partition.portals.empty());
}

BuiltTree TreeOf(const Built& built, MemoryBudget& budget) {
  const SceneInfo info = LoadSceneInfo(*built.store);
  ScratchShelf shelf(*built.store, budget, "walls");
  return BuildTree(Grown(info.bounds, 1),
                   GatherWalls(*built.store, info, budget, shelf),
                   shelf,
                   budget);
}

// A corridor that is closed every metre by walls of many parts.
constexpr uint32_t kWalls = 100;
constexpr uint32_t kParts = 200;

BuiltTree TreeOfCorridor(MemoryBudget& budget) {
  const auto store = CreateStoreInMemory();
  ScratchShelf shelf(*store, budget, "walls");
  Walls walls{FragmentList(shelf), {.all_split = true, .up = {0, 0, 1}}};
  for (uint32_t i = 0; i < kWalls; ++i) {
    for (uint32_t k = 0; k < kParts; ++k) {
      const double x = i;
      const double y = k;
      const Polygon part = {{x, y, 0}, {x, y + 1, 0}, {x, y + 1, 1}, {x, y, 1}};
      walls.fragments.Add({part, PlaneOf(part), i});
    }
  }
  const Box3 box{{-1, -1, -1}, {kWalls + 1, kParts + 1, 2}};
  BuiltTree built = BuildTree(box, std::move(walls), shelf, budget);
  shelf.Clear();
  EXPECT_EQ(store->Count(BlockKind::kScratch), 0U);
  return built;
}

TEST(BuildTree, WallsAreChargedWhileCellsAreFound) {
  MemoryBudget roomy(1U << 30);
  const BuiltTree built = TreeOfCorridor(roomy);
  EXPECT_EQ(built.leaves.size(), kWalls + 1);
  EXPECT_EQ(roomy.UsedBytes(), BytesOf(built));
  EXPECT_GT(roomy.PeakBytes(), kWalls * kParts * 4 * sizeof(Point3));
  MemoryBudget none(BytesOf(built) / 2);
  EXPECT_THROW(TreeOfCorridor(none), DoesNotFitError);
}

// The tree does not depend on how much of the walls is in memory.
TEST(BuildTree, IsTheSameWhereWallsDoNotFitIntoMemory) {
  MemoryBudget roomy(1U << 30);
  const BuiltTree whole = TreeOfCorridor(roomy);
  MemoryBudget small(roomy.PeakBytes() / 2);
  const BuiltTree built = TreeOfCorridor(small);
  ASSERT_EQ(built.tree.nodes.size(), whole.tree.nodes.size());
  for (size_t i = 0; i < whole.tree.nodes.size(); ++i) {
    ASSERT_EQ(built.tree.nodes[i].plane.offset,
              whole.tree.nodes[i].plane.offset);
  }
}

class FindOpenBordersTest : public ::testing::Test {
 protected:
  OpenBorders Find(MemoryBudget& budget, GrowingCharge& charge) {
    return FindOpenBorders(
        {*built_.store, tree_, survey_, kCrackM}, shelf_, budget, charge);
  }

  const Built built_{TwoRoomsWithDoor()};
  MemoryBudget roomy_{1U << 30};
  const BuiltTree tree_ = TreeOf(built_, roomy_);
  const FaceSurvey survey_ = SurveyFaces(*built_.store, tree_.tree, roomy_);
  ScratchShelf shelf_{*built_.store, roomy_, "openings"};
  GrowingCharge charge_{roomy_, "borders"};
};

TEST_F(FindOpenBordersTest, BordersAreChargedAsTheyAreFound) {
  MemoryBudget none(100);
  GrowingCharge charge(none, "borders");
  EXPECT_THROW(Find(roomy_, charge), DoesNotFitError);
}

using Openings = std::vector<std::pair<NodeId, Polygon>>;

Openings OpeningsOf(const OpenBorders& borders) {
  Openings openings;
  borders.ForEachOpening([&](const LeafBorder& border, Polygon opening) {
    openings.emplace_back(border.node, std::move(opening));
  });
  return openings;
}

TEST_F(FindOpenBordersTest, OpeningsAddUpToWhatIsOpen) {
  const OpenBorders borders = Find(roomy_, charge_);
  double open_m2 = 0;
  for (const LeafBorder& border : borders.All()) {
    EXPECT_GT(border.open_m2, 0);
    EXPECT_LE(border.open_m2, border.area_m2 * (1 + 1e-12));
    open_m2 += border.open_m2;
  }
  double openings_m2 = 0;
  uint64_t bytes = 0;
  for (const auto& [node, opening] : OpeningsOf(borders)) {
    openings_m2 += PolygonArea(opening);
    bytes += opening.size() * sizeof(Point3);
  }
  EXPECT_NEAR(openings_m2, open_m2, 1e-9 * open_m2);
  EXPECT_GT(bytes, 0U);
  EXPECT_GE(bytes + 100 * borders.All().size(), borders.MostBytesOfNode());
}

// Only the faces in the planes of a few nodes fit into memory at a time.
TEST_F(FindOpenBordersTest, AreTheSameInSeveralPasses) {
  const OpenBorders at_once = Find(roomy_, charge_);
  const uint64_t most =
      *std::max_element(survey_.cover_bytes.begin(), survey_.cover_bytes.end());
  MemoryBudget small(most + 100);
  const OpenBorders one_by_one = Find(small, charge_);
  EXPECT_LE(small.PeakBytes(), most + 100);
  EXPECT_GT(small.PeakBytes(), 0U);
  EXPECT_EQ(OpeningsOf(one_by_one), OpeningsOf(at_once));
}

TEST(Subtract, WhatIsLeftOfManyCoversIsTold) {
  constexpr size_t kRow = 40;
  const Polygon whole = {
      {0, 0, 0}, {kRow, 0, 0}, {kRow, kRow, 0}, {0, kRow, 0}};
  std::vector<Polygon> covers;
  for (size_t i = 0; i < kRow * kRow; ++i) {
    const auto x = static_cast<double>(i % kRow);
    const auto y = static_cast<double>(i / kRow);
    covers.push_back({{x + 0.2, y + 0.2, 0},
                      {x + 0.6, y + 0.2, 0},
                      {x + 0.6, y + 0.6, 0},
                      {x + 0.2, y + 0.6, 0}});
  }
  std::vector<const Polygon*> all;
  for (const Polygon& cover : covers) {
    all.push_back(&cover);
  }
  uint64_t told = 0;
  const std::vector<Polygon> left = Subtract(
      whole, {0, 0, 1}, all, kCrackM, [&](uint64_t bytes, double /*share*/) {
        told = bytes;
      });
  EXPECT_GT(left.size(), covers.size());
  EXPECT_GE(told, left.size() * (sizeof(Polygon) + 3 * sizeof(Point3)));
}

TEST(Cells, LoadedPartitionIsTheOneBuilt) {
  const Built built(TwoRoomsWithDoor());
  uint64_t told = 0;
  const Partition loaded =
      LoadPartition(*built.store, [&](uint64_t bytes) { told = bytes; });
  EXPECT_GE(told,
            loaded.portals.size() * (sizeof(Portal) + 4 * sizeof(Point3)));
  ASSERT_EQ(loaded.cells.size(), built.partition.cells.size());
  for (size_t i = 0; i < loaded.cells.size(); ++i) {
    EXPECT_EQ(loaded.cells[i].patches, built.partition.cells[i].patches);
    EXPECT_EQ(loaded.cells[i].area_m2, built.partition.cells[i].area_m2);
    EXPECT_EQ(loaded.cells[i].bounds.low, built.partition.cells[i].bounds.low);
  }
  ASSERT_EQ(loaded.portals.size(), built.partition.portals.size());
  for (size_t i = 0; i < loaded.portals.size(); ++i) {
    EXPECT_EQ(loaded.portals[i].vertices, built.partition.portals[i].vertices);
    EXPECT_EQ(loaded.portals[i].front, built.partition.portals[i].front);
  }
  EXPECT_EQ(loaded.notes, built.partition.notes);
  const std::vector<CellInfo> cells = LoadCells(*built.store);
  ASSERT_EQ(cells.size(), loaded.cells.size());
  uint64_t portals = 0;
  EXPECT_EQ(LoadWithoutPortals(*built.store, &portals).notes, loaded.notes);
  EXPECT_EQ(portals, loaded.portals.size());
  EXPECT_EQ(cells.back().area_m2, loaded.cells.back().area_m2);
  uint64_t bytes = 0;
  size_t visited = 0;
  ForEachPortal(*built.store, [&](const Portal& portal) {
    EXPECT_EQ(portal.vertices, loaded.portals.at(visited++).vertices);
    bytes += BytesOf(portal);
  });
  EXPECT_EQ(visited, loaded.portals.size());
  EXPECT_GE(bytes, told);
  EXPECT_LE(bytes, told + 16 * visited);
}

}  // namespace
}  // namespace enfilade
