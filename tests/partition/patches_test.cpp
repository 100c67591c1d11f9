// Faces cut to cells and into patches.

#include "base/photometry.h"
#include "base/random.h"
#include "partition/patch_cutter.h"

#include <array>
#include <cmath>
#include <tuple>
#include <vector>

#include "tests/partition/test_scenes.h"
#include <gtest/gtest.h>

namespace enfilade {
namespace {

using testing::Built;
using testing::SceneBuilder;
using testing::TwoRoomsWithDoor;

double Area(const std::vector<PatchPiece>& pieces) {
  double area = 0;
  for (const PatchPiece& piece : pieces) {
    area += Length(Cross(piece.u, piece.v)) *
            (piece.shape == PatchShape::kTriangle ? 0.5 : 1.0);
  }
  return area;
}

std::vector<Patch> AllPatches(const Built& built) {
  std::vector<Patch> patches;
  for (uint32_t i = 0; i < built.partition.cells.size(); ++i) {
    const CellPatches cell = LoadCellPatches(*built.store, CellId(i));
    EXPECT_EQ(cell.patches.size(), built.partition.cells[i].patches);
    patches.insert(patches.end(), cell.patches.begin(), cell.patches.end());
  }
  return patches;
}

TEST(PatchCutter, ParallelogramStaysOne) {
  const auto pieces =
      CutIntoPatches({{0, 0, 0}, {2, 0, 0}, {3, 1, 0}, {1, 1, 0}});
  ASSERT_EQ(pieces.size(), 1U);
  EXPECT_EQ(pieces[0].shape, PatchShape::kParallelogram);
}

// A rectangle of which one corner is moved along an edge.
Polygon OffBy(double move_m, double side = 2) {
  return {{0, 0, 0}, {side, 0, 0}, {side + move_m, 1, 0}, {0, 1, 0}};
}

// Rounding takes a corner off by a step; a quarter of that moves each corner of
// the nearest parallelogram.
TEST(PatchCutter, WhatIsAParallelogramButForRoundingStaysOne) {
  constexpr double kMove = 4 * kMostCornerMoveM;
  for (const double sign : {1.0, -1.0}) {
    const Polygon polygon = OffBy(sign * 0.99 * kMove);
    const auto pieces = CutIntoPatches(polygon);
    ASSERT_EQ(pieces.size(), 1U);
    EXPECT_NEAR(Area(pieces), PolygonArea(polygon), 1e-12);
    const PatchPiece& piece = pieces[0];
    const std::array<Point3, 4> corners = {piece.origin,
                                           piece.origin + piece.u,
                                           piece.origin + piece.u + piece.v,
                                           piece.origin + piece.v};
    for (size_t i = 0; i < corners.size(); ++i) {
      EXPECT_NEAR(
          Length(corners[i] - polygon[i]), 0.99 * kMostCornerMoveM, 1e-9);
    }
    EXPECT_EQ(CutIntoPatches(OffBy(sign * 1.01 * kMove)).size(), 2U);
  }
  // Thin slats are what they are.
  EXPECT_EQ(CutIntoPatches(OffBy(0.99 * kMove, 0.009)).size(), 2U);
}

// The edge between two such quadrilaterals swings to both sides of where it
// was: they do not lie in one another for that.
TEST(PatchCutter, NeighboursThatAreAlmostParallelogramsStayApart) {
  for (const double move : {1.9e-4, -1.9e-4}) {
    std::vector<Patch> patches;
    const std::vector<Polygon> polygons = {
        OffBy(move), {{2, 0, 0}, {4, 0, 0}, {4, 1, 0}, {2 + move, 1, 0}}};
    for (uint32_t i = 0; i < polygons.size(); ++i) {
      for (const PatchPiece& piece : CutIntoPatches(polygons[i])) {
        Patch patch;
        patch.origin = piece.origin;
        patch.u = piece.u;
        patch.v = piece.v;
        patch.shape = piece.shape;
        patch.face = FaceId(i);
        patch.material = MaterialId(i);
        patches.push_back(patch);
      }
    }
    ASSERT_EQ(patches.size(), 2U);
    const OverlapCounts counts = testing::Separate(patches);
    EXPECT_EQ(counts.dropped, 0U);
    EXPECT_EQ(counts.moved, 0U);
    EXPECT_EQ(patches.size(), 2U);
  }
}

// The survey of faces, before cells are found, goes by this.
TEST(PatchCutter, CountsWhatItCuts) {
  const std::vector<Polygon> polygons = {
      {{0, 0, 0}, {2, 0, 0}, {3, 1, 0}, {1, 1, 0}},
      // A corridor's ceiling that ends in a point: a long parallelogram and
      // more.
      {{0, 0, 0}, {60, 0, 0}, {61, 0.75, 0}, {60, 1.5, 0}, {0, 1.5, 0}},
      // Coordinates rounded to a micrometre.
      {{0, 0, 0}, {60, 0, 0}, {60, 1.500001, 0}, {0, 1.5, 0}},
      {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}};
  for (const Polygon& polygon : polygons) {
    EXPECT_EQ(CountPatches(polygon),
              CutLongOnes(CutIntoPatches(polygon)).size());
  }
  EXPECT_GT(CountPatches(polygons[1]), 30U);
}

TEST(PatchCutter, TrapezoidIsTwoPieces) {
  EXPECT_EQ(CutIntoPatches({{0, 0, 0}, {3, 0, 0}, {2, 1, 0}, {0, 1, 0}}).size(),
            2U);
}

TEST(PatchCutter, CornersOnStraightEdgesCostNothing) {
  EXPECT_EQ(
      CutIntoPatches(
          {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {2, 1, 0}, {1, 1, 0}, {0, 1, 0}})
          .size(),
      1U);
}

TEST(PatchCutter, HexagonUsesAParallelogram) {
  Polygon hexagon;
  for (int i = 0; i < 6; ++i) {
    hexagon.push_back({std::cos(i * kPi / 3), std::sin(i * kPi / 3), 0.0});
  }
  EXPECT_EQ(CutIntoPatches(hexagon).size(), 3U);
}

TEST(PatchCutter, PiecesCoverTheAreaAndFaceThePolygonsWay) {
  Random random(3);
  for (int round = 0; round < 200; ++round) {
    const int n = 3 + static_cast<int>(random.NextBelow(7));
    Polygon polygon;
    for (int i = 0; i < n; ++i) {
      const double angle = 2 * kPi * (i + 0.8 * random.Next()) / n;
      polygon.push_back(
          {3 * std::cos(angle), 2 * std::sin(angle), std::cos(angle)});
    }
    const Vec3 normal = Normalize(AreaVector(polygon));
    const auto pieces = CutIntoPatches(polygon);
    EXPECT_LE(pieces.size(), static_cast<size_t>(n - 2));
    EXPECT_NEAR(Area(pieces), PolygonArea(polygon), 1e-9);
    for (const PatchPiece& piece : pieces) {
      EXPECT_GT(Dot(Cross(piece.u, piece.v), normal), 0);
    }
  }
}

PatchPiece Parallelogram(Vec3 u, Vec3 v) {
  return {{1, 2, 3}, u, v, PatchShape::kParallelogram};
}

// A corridor's ceiling with its length along either edge, and an oblique wall,
// whose lengths are those of its sides.
TEST(LongPatches, AreCutAcrossIntoParts) {
  for (const PatchPiece& piece : {Parallelogram({60, 0, 0}, {0, 1.5, 0}),
                                  Parallelogram({0, 1.5, 0}, {-60, 0, 0}),
                                  Parallelogram({48, 36, 0}, {0, 0, 1.5})}) {
    const auto cut = CutLongOnes({piece});
    EXPECT_EQ(cut.size(), 40U);
    EXPECT_NEAR(Area(cut), Area({piece}), 1e-9);
    for (size_t i = 0; i < cut.size(); ++i) {
      EXPECT_NEAR(Length(cut[i].u), 1.5, 1e-12);
      EXPECT_NEAR(Length(cut[i].v), 1.5, 1e-12);
    }
    const Vec3 along = Length(piece.u) > Length(piece.v) ? piece.u : piece.v;
    EXPECT_EQ(cut.front().origin, piece.origin);
    EXPECT_NEAR(Length(cut.back().origin - piece.origin - along * (39 / 40.0)),
                0,
                1e-12);
  }
}

TEST(LongPatches, StayWholeWhereTheyAreShortOrTriangles) {
  PatchPiece triangle = Parallelogram({60, 0, 0}, {0, 1.5, 0});
  triangle.shape = PatchShape::kTriangle;
  for (const PatchPiece& piece :
       {Parallelogram({5.3, 0, 0}, {0, 2.7, 0}),    // a wall
        Parallelogram({0.04, 0, 0}, {0, 0.45, 0}),  // the leg of a chair
        Parallelogram({0.1, 0, 0}, {0, 1.9, 0}),    // a post
        triangle}) {
    EXPECT_EQ(CutLongOnes({piece}).size(), 1U);
  }
  // A skirting board is not cut into its squares either.
  EXPECT_EQ(CutLongOnes({Parallelogram({5.5, 0, 0}, {0, 0, 0.1})}).size(), 5U);
}

TEST(Patches, AreStoredWhole) {
  Random random(5);
  CellPatches cell;
  cell.bounds = {{-1, -2, -3}, {1, 2, 3}};
  for (int i = 0; i < 64; ++i) {
    Patch p;
    p.origin = {random.Next(), random.Next(), random.Next()};
    p.u = {1 + random.Next(), random.Next(), 0};
    p.v = {0, 1 + random.Next(), random.Next()};
    p.shape = (i & 1) != 0 ? PatchShape::kTriangle : PatchShape::kParallelogram;
    p.material = MaterialId(random.NextBelow(1000));
    p.face = FaceId(random.NextBelow(1000000));
    p.emits = (i & 2) != 0;
    p.reflects = (i & 4) != 0;
    p.is_twin = (i & 8) != 0;
    p.is_back = (i & 16) != 0;
    p.is_enclosed = (i & 32) != 0;
    p.layer = static_cast<uint8_t>(i % (kMostLayers + 1));
    cell.patches.push_back(p);
  }
  const CellPatches read = DecodeCellPatches(EncodeCellPatches(cell));
  EXPECT_EQ(read.bounds.low.y, -2);
  ASSERT_EQ(read.patches.size(), cell.patches.size());
  for (size_t i = 0; i < cell.patches.size(); ++i) {
    const Patch& a = cell.patches[i];
    const Patch& b = read.patches[i];
    EXPECT_EQ(Length(a.origin - b.origin) + Length(a.u - b.u), 0);
    EXPECT_EQ(Length(a.v - b.v), 0);
    EXPECT_EQ(std::tuple(a.shape, a.material, a.face, a.emits, a.reflects),
              std::tuple(b.shape, b.material, b.face, b.emits, b.reflects));
    EXPECT_EQ(std::tuple(a.is_twin, a.is_back, a.is_enclosed, a.layer),
              std::tuple(b.is_twin, b.is_back, b.is_enclosed, b.layer));
  }
}

TEST(Patches, EverySideOfEveryFaceIsCoveredOnce) {
  SceneBuilder scene = TwoRoomsWithDoor();
  scene.AddBox({{3.5, 0.5, 0.7}, {4.5, 1.3, 0.74}});  // stands in the wall
  const Built built(scene);
  std::vector<double> front(scene.Faces().size());
  std::vector<double> back(scene.Faces().size());
  for (const Patch& patch : AllPatches(built)) {
    const Face& face = scene.Faces()[patch.face.Index()];
    const bool is_front =
        Dot(PatchNormal(patch), AreaVector(face.vertices)) > 0;
    (is_front ? front : back)[patch.face.Index()] += PatchArea(patch);
  }
  for (size_t i = 0; i < scene.Faces().size(); ++i) {
    const double area = PolygonArea(scene.Faces()[i].vertices);
    EXPECT_NEAR(front[i], area, 1e-8) << "front of face " << i;
    EXPECT_NEAR(back[i], area, 1e-8) << "back of face " << i;
  }
}

TEST(Patches, LookIntoTheirOwnCell) {
  const Built built(TwoRoomsWithDoor());
  for (uint32_t i = 0; i < built.partition.cells.size(); ++i) {
    for (const Patch& patch :
         LoadCellPatches(*built.store, CellId(i)).patches) {
      const Point3 middle = patch.origin + (patch.u + patch.v) * 0.3;
      EXPECT_EQ(built.At(middle + PatchNormal(patch) * 1e-3), CellId(i));
    }
  }
}

TEST(Patches, BothSidesInOneCellAreTwins) {
  SceneBuilder scene = TwoRoomsWithDoor();
  scene.Add(SceneBuilder::Rectangle{2, 0.7, 1, 1, 2, 2});  // a table top
  const Built built(scene);
  const auto room = LoadCellPatches(*built.store, built.At({1, 1, 1}));
  int twins = 0;
  for (size_t i = 0; i < room.patches.size(); ++i) {
    const Patch& patch = room.patches[i];
    if (patch.is_twin) {
      ++twins;
      ASSERT_GT(i, 0U);
      const Patch& front = room.patches[i - 1];
      EXPECT_EQ(front.face, patch.face);
      EXPECT_EQ(front.u, patch.v);
      EXPECT_EQ(front.v, patch.u);
      EXPECT_FALSE(front.is_twin);
    }
  }
  EXPECT_EQ(twins, 1);
}

TEST(Patches, OneSidedFaceBlocksFromBehindWithoutReflecting) {
  SceneBuilder scene;
  scene.AddBox({{0, 0, 0}, {4, 3, 2.7}});
  scene.Add(SceneBuilder::Rectangle{0, 2, 0, 0, 3, 2.7}, MaterialId(1U));
  scene.Add(SceneBuilder::Rectangle{2, 0.7, 0.5, 0.5, 1, 1}, MaterialId(1U));
  const Built built(scene);
  int black = 0;
  int one_sided = 0;
  for (const Patch& patch : AllPatches(built)) {
    black += patch.reflects ? 0 : 1;
    one_sided += patch.material == MaterialId(1U) ? 1 : 0;
    if (!patch.reflects) {
      EXPECT_LT(PatchNormal(patch).x, 0);
    }
  }
  EXPECT_EQ(black, 1);      // the back of the wall, in the other room
  EXPECT_EQ(one_sided, 3);  // and no twin of the table top
}

TEST(Patches, OnlyTheFrontOfALampEmits) {
  SceneBuilder scene = TwoRoomsWithDoor();
  scene.Add(SceneBuilder::Rectangle{2, 2.6, 1, 1, 1.5, 1.5}, MaterialId(2U));
  const Built built(scene);
  int emitting = 0;
  for (const Patch& patch : AllPatches(built)) {
    if (patch.emits) {
      ++emitting;
      EXPECT_GT(PatchNormal(patch).z, 0);
    }
  }
  EXPECT_EQ(emitting, 1);
}

TEST(Patches, CellsStayUnderTheirLimit) {
  SceneBuilder scene = TwoRoomsWithDoor();
  Random random(5);
  for (int i = 0; i < 150; ++i) {
    const Point3 low{
        7.5 * random.Next(), 2.5 * random.Next(), 2.2 * random.Next()};
    scene.AddBox({low, low + Vec3{0.2, 0.2, 0.2}});
  }
  PartitionOptions options;
  options.max_cell_patches = 500;
  const Built built(scene, options);
  EXPECT_GT(built.partition.cells.size(), 4U);
  for (const CellInfo& cell : built.partition.cells) {
    EXPECT_LE(cell.patches, options.max_cell_patches);
  }
}

// A strip is cut into many patches, all of which count.
TEST(Patches, CellsFullOfStripsStayUnderTheirLimit) {
  SceneBuilder scene;
  scene.AddBox({{0, 0, 0}, {12, 8, 3}});
  for (int i = 0; i < 60; ++i) {
    const double y = 0.5 + 0.12 * i;
    scene.Add({2, 2.5, 0.5, y, 11.5, y + 0.1});
  }
  PartitionOptions options;
  options.max_cell_patches = 400;  // each side of each strip makes 11
  const Built built(scene, options);
  uint64_t patches = 0;
  for (const CellInfo& cell : built.partition.cells) {
    EXPECT_LE(cell.patches, 2 * options.max_cell_patches);
    patches += cell.patches;
  }
  EXPECT_GT(patches, 1200U);
}

TEST(Patches, SameSceneSameBytes) {
  const SceneBuilder scene = TwoRoomsWithDoor();
  const Built a(scene);
  const Built b(scene);
  for (uint32_t i = 0; i < a.partition.cells.size(); ++i) {
    EXPECT_EQ(a.store->GetOrThrow({BlockKind::kCellPatches, i}),
              b.store->GetOrThrow({BlockKind::kCellPatches, i}));
  }
}

}  // namespace
}  // namespace enfilade
