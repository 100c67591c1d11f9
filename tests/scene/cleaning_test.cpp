#include "base/photometry.h"
#include "base/planar_polygon.h"
#include "scene/mesh_cleaner.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "tests/cpu_time.h"
#include "tests/memory_peak.h"
#include <gtest/gtest.h>

namespace enfilade {
namespace {

using Polygons = std::vector<std::vector<Point3>>;

struct Cleaned {
  Polygons faces;
  std::vector<std::optional<ClosedSolid>> solids;  // of the faces
  std::vector<double> surfaces;                    // their areas, m2
  CleaningCounts counts;

  [[nodiscard]] double Area() const {
    double area = 0;
    for (const auto& face : faces) {
      area += PolygonArea(face);
    }
    return area;
  }
};

Cleaned Clean(const Polygons& polygons, bool oriented = false) {
  MemoryBudget budget(1ULL << 26);
  MeshCleaner cleaner(budget);
  for (const auto& polygon : polygons) {
    cleaner.Add(polygon);
  }
  Cleaned cleaned;
  CleaningOptions options;
  options.oriented = oriented;
  options.emit = [&](const CleanFace& face) {
    cleaned.faces.emplace_back(face.polygon.begin(), face.polygon.end());
    cleaned.solids.push_back(face.solid);
    cleaned.surfaces.push_back(face.surface_m2);
  };
  cleaner.Flush(options);
  cleaned.counts = cleaner.Counts();
  return cleaned;
}

constexpr Point3 kA{0, 0, 0}, kB{1, 0, 0}, kC{1, 1, 0}, kD{0, 1, 0};

TEST(Cleaning, TwoTrianglesOfASquareAreOneFace) {
  const Cleaned cleaned = Clean({{kA, kB, kC}, {kA, kC, kD}});
  ASSERT_EQ(cleaned.faces.size(), 1U);
  EXPECT_EQ(cleaned.faces[0].size(), 4U);
  EXPECT_EQ(cleaned.Area(), 1.0);
}

// A face of the box between the corners (0, 0, 0) and (2, 2, 2), with its edges
// in pieces.
std::vector<Point3> FaceInPieces(const std::array<Point3, 4>& corners,
                                 size_t pieces) {
  std::vector<Point3> face;
  for (size_t k = 0; k < corners.size(); ++k) {
    const Point3 from = corners[k];
    const Vec3 edge = corners[(k + 1) % corners.size()] - from;
    for (size_t i = 0; i < pieces; ++i) {
      // Exact, so that the two faces of an edge have the same points.
      face.push_back(
          from + edge * (static_cast<double>(i) / static_cast<double>(pieces)));
    }
  }
  return face;
}

// Edges of a box that other parts of a building have cut into thousands.
TEST(Cleaning, ASolidOfManyCornersTakesNoMoreThanIsCharged) {
#ifndef ENFILADE_JEMALLOC
  GTEST_SKIP() << "sanitizers keep what is freed";
#endif
  constexpr size_t kPieces = 1 << 13;
  constexpr std::array<std::array<Point3, 4>, 6> kBox = {
      {{{{0, 0, 0}, {0, 2, 0}, {2, 2, 0}, {2, 0, 0}}},
       {{{0, 0, 2}, {2, 0, 2}, {2, 2, 2}, {0, 2, 2}}},
       {{{0, 0, 0}, {2, 0, 0}, {2, 0, 2}, {0, 0, 2}}},
       {{{2, 2, 0}, {0, 2, 0}, {0, 2, 2}, {2, 2, 2}}},
       {{{2, 0, 0}, {2, 2, 0}, {2, 2, 2}, {2, 0, 2}}},
       {{{0, 2, 0}, {0, 0, 0}, {0, 0, 2}, {0, 2, 2}}}}};
  const uint64_t before = BeginPeak();
  MemoryBudget budget(1ULL << 28);
  MeshCleaner cleaner(budget);
  for (const auto& corners : kBox) {
    cleaner.Add(FaceInPieces(corners, kPieces));
  }
  size_t solids = 0;
  CleaningOptions options;
  options.emit = [&](const CleanFace& face) { solids += face.solid ? 1U : 0U; };
  cleaner.Flush(options);
  EXPECT_EQ(solids, 6U);
  EXPECT_LE(PeakResidentBytes(), before + budget.PeakBytes());
}

TEST(Cleaning, OrientationMattersOnlyWhereSidesDiffer) {
  const Polygons opposed = {{kA, kB, kC}, {kA, kD, kC}};
  EXPECT_EQ(Clean(opposed).faces.size(), 1U);
  EXPECT_EQ(Clean(opposed, /*oriented=*/true).faces.size(), 2U);
}

TEST(Cleaning, DoubledFacesAreOneFace) {
  const Cleaned cleaned = Clean({{kA, kB, kC}, {kC, kB, kA}, {kB, kC, kA}});
  EXPECT_EQ(cleaned.faces.size(), 1U);
  EXPECT_EQ(cleaned.counts.duplicates, 2U);
}

TEST(Cleaning, FacesWithoutAreaAreDropped) {
  const Cleaned cleaned =
      Clean({{kA, kB, {2, 0, 0}}, {kA, kA, kB}, {kA, kB, kC}});
  EXPECT_EQ(cleaned.faces.size(), 1U);
  EXPECT_EQ(cleaned.counts.zero_area, 2U);
}

// A bow tie has as much area turned one way as the other.
TEST(Cleaning, FacesThatCrossThemselvesAreToldOf) {
  const Cleaned cleaned =
      Clean({{kA, kC, kB, kD}, {kA, kB, {2, 0, 0}}, {kA, kB, kC, kD}});
  EXPECT_EQ(cleaned.faces.size(), 1U);
  EXPECT_EQ(cleaned.counts.zero_area, 2U);
  EXPECT_EQ(cleaned.counts.crossed, 1U);
  const std::vector<std::string> notes = cleaned.counts.Notes();
  EXPECT_TRUE(std::any_of(notes.begin(), notes.end(), [](const auto& note) {
    return note.find("1 polygons cross themselves") != std::string::npos;
  }));
}

TEST(Cleaning, NearlyEqualVerticesAreWelded) {
  constexpr Point3 kNearC{1 + 1e-6, 1, 0};
  EXPECT_EQ(Clean({{kA, kB, kC}, {kA, kNearC, kD}}).faces.size(), 1U);
}

// A hundred-thousandth of so small a polygon is no distance between numbers as
// large as these.
TEST(Cleaning, WhatDiffersByRoundingAloneHasNoArea) {
  constexpr double kTiny = 6.1e-17;
  const Cleaned cleaned =
      Clean({{{0, 1000, 0}, {kTiny, 1000, 0}, {0, 1000, kTiny}}});
  EXPECT_EQ(cleaned.faces.size(), 0U);
  EXPECT_EQ(cleaned.counts.zero_area, 1U);
}

TEST(Cleaning, CornersAreNotFlattened) {
  const Cleaned cleaned =
      Clean({{kA, kB, kC, kD}, {kA, kB, {1, 0, 1}, {0, 0, 1}}});
  EXPECT_EQ(cleaned.faces.size(), 2U);
}

// The six sides of a box, their fronts outside.
Polygons BoxSides(Point3 low, Point3 high) {
  const auto at = [&](int x, int y, int z) {
    return Point3{
        x > 0 ? high.x : low.x, y > 0 ? high.y : low.y, z > 0 ? high.z : low.z};
  };
  return {{at(0, 0, 0), at(0, 1, 0), at(1, 1, 0), at(1, 0, 0)},
          {at(0, 0, 1), at(1, 0, 1), at(1, 1, 1), at(0, 1, 1)},
          {at(0, 0, 0), at(1, 0, 0), at(1, 0, 1), at(0, 0, 1)},
          {at(0, 1, 0), at(0, 1, 1), at(1, 1, 1), at(1, 1, 0)},
          {at(0, 0, 0), at(0, 0, 1), at(0, 1, 1), at(0, 1, 0)},
          {at(1, 0, 0), at(1, 1, 0), at(1, 1, 1), at(1, 0, 1)}};
}

// A table top, smaller or larger, continues the top of a chest. Both of its
// sides are free, and only the sides of the chest have an inside.
TEST(Cleaning, ASheetInThePlaneOfASolidIsNoPartOfIt) {
  for (const double wide : {0.5, 4.0}) {
    Polygons polygons = BoxSides({0, 0, 0}, {1, 1, 1});
    polygons.push_back(
        {{1, 0, 1}, {1 + wide, 0, 1}, {1 + wide, 1, 1}, {1, 1, 1}});
    const Cleaned cleaned = Clean(polygons);
    ASSERT_EQ(cleaned.faces.size(), 7U);
    for (size_t i = 0; i < cleaned.faces.size(); ++i) {
      EXPECT_EQ(cleaned.solids[i].has_value(),
                BoundsOf(cleaned.faces[i]).high.x <= 1)
          << i;
    }
  }
}

// Steps of a stair meet corner to corner: the top of one and the bottom of the
// next lie in one plane, with their insides on different sides of it.
TEST(Cleaning, SolidsThatGoOnInOnePlaneStayApart) {
  Polygons polygons = BoxSides({0, 0, 0}, {1, 1, 1});
  for (const auto& side : BoxSides({1, 0, 1}, {2, 1, 2})) {
    polygons.push_back(side);
  }
  const Cleaned cleaned = Clean(polygons);
  ASSERT_EQ(cleaned.faces.size(), 12U);
  for (size_t i = 0; i < cleaned.faces.size(); ++i) {
    ASSERT_TRUE(cleaned.solids[i]) << i;
    const Box3& inside = cleaned.solids[i]->bounds;
    const Vec3 normal = AreaVector(cleaned.faces[i]);
    const double along = Dot(inside.Center() - cleaned.faces[i][0], normal);
    EXPECT_EQ(cleaned.solids[i]->front_is_inside, along > 0) << i;
  }
}

TEST(Cleaning, FourSheetsAtOneEdgeStayFour) {
  Polygons sheets;
  for (const Point3 tip : {Point3{0, 1, 0},
                           Point3{0, -1, 0.5},
                           Point3{0, 0, 1},
                           Point3{0, 0.5, -1}}) {
    sheets.push_back({kA, kB, tip});
  }
  EXPECT_EQ(Clean(sheets).faces.size(), 4U);
}

// Its pieces know how large the surface is that they are of; a sheet elsewhere
// in the plane is another surface.
TEST(Cleaning, FrameAroundAHoleKeepsItsAreaInFourPieces) {
  const Point3 p{1, 1, 0}, q{2, 1, 0}, r{2, 2, 0}, s{1, 2, 0};
  const Point3 a{0, 0, 0}, b{3, 0, 0}, c{3, 3, 0}, d{0, 3, 0};
  const Cleaned cleaned = Clean({{a, b, q},
                                 {a, q, p},
                                 {b, c, r},
                                 {b, r, q},
                                 {c, d, s},
                                 {c, s, r},
                                 {d, a, p},
                                 {d, p, s},
                                 {{9, 0, 0}, {10, 0, 0}, {10, 1, 0}}});
  ASSERT_EQ(cleaned.faces.size(), 5U);
  EXPECT_NEAR(cleaned.Area(), 8.5, 1e-12);
  for (size_t i = 0; i < cleaned.faces.size(); ++i) {
    EXPECT_NEAR(
        cleaned.surfaces[i], cleaned.faces[i].size() == 3 ? 0.5 : 8, 1e-12);
  }
}

TEST(Cleaning, OutlineWithABridgedHoleIsCut) {
  const Cleaned cleaned = Clean({{{0, 0, 0},
                                  {3, 0, 0},
                                  {3, 3, 0},
                                  {0, 3, 0},
                                  {0, 0, 0},
                                  {1, 1, 0},
                                  {1, 2, 0},
                                  {2, 2, 0},
                                  {2, 1, 0},
                                  {1, 1, 0}}});
  EXPECT_NEAR(cleaned.Area(), 8, 1e-12);
}

TEST(Cleaning, WarpedQuadsBecomeTriangles) {
  const Cleaned cleaned = Clean({{kA, kB, {1, 1, 0.2}, kD}});
  EXPECT_EQ(cleaned.faces.size(), 2U);
  EXPECT_EQ(cleaned.counts.warped, 1U);
}

// A star has its points bent up. Each cut of a point changes the corners beside
// it and removes what was in the way of other cuts.
std::vector<Point3> BentStar(int corners) {
  std::vector<Point3> star;
  for (int i = 0; i < corners; ++i) {
    const double angle = 2 * kPi * i / corners;
    const double radius = i % 2 == 0 ? 100 : 99;
    star.push_back({radius * std::cos(angle),
                    radius * std::sin(angle),
                    i % 2 == 0 ? 0.1 : 0.0});
  }
  return star;
}

TEST(Cleaning, AWarpedFaceOfManyCornersIsCutWithoutLoss) {
  constexpr int kCorners = 1000;
  const Cleaned cleaned = Clean({BentStar(kCorners)});
  EXPECT_EQ(cleaned.counts.warped, 1U);
  // A flat star is kCorners triangles at the middle. What is bent are the
  // points, each about 1 m high on a base between two inner corners.
  const double turn = 2 * kPi / kCorners;
  const double flat = kCorners * 0.5 * 99 * 100 * std::sin(turn);
  const double height = 100 - 99 * std::cos(turn);
  const double longer = std::hypot(height, 0.1) - height;
  const double bent = kCorners / 2 * 99 * std::sin(turn) * longer;
  EXPECT_NEAR(cleaned.Area(), flat + bent, 1e-6 * flat);
}

// Checking every corner anew for each cut takes 64 times as long for four times
// the corners. Each check looks at all corners, so that as many checks as there
// are corners take 16 times, and the bound lies between.
TEST(Cleaning, CornersAreNotCheckedAnewForEachCut) {
  const auto seconds = [](int corners) {
    const std::vector<Point3> star = BentStar(corners);
    return CpuSecondsOf([&] { EXPECT_GT(Clean({star}).faces.size(), 1U); });
  };
  EXPECT_LT(seconds(2000), 32 * seconds(500));
}

}  // namespace
}  // namespace enfilade
