#include "scene/crack_closer.h"

#include "base/memory.h"
#include "base/planar_polygon.h"
#include "base/random.h"
#include "scene/box_tree.h"
#include "scene/plane_snap.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "tests/memory_peak.h"
#include <gtest/gtest.h>

namespace enfilade {
namespace {

constexpr double kTolerance = 3e-3;
constexpr double kExact = 1e-9;

using Outline = std::vector<Point3>;

CrackSummary Close(std::vector<PolygonWithOpenings>& polygons) {
  MemoryBudget budget(1 << 24);
  const CrackSummary summary = CloseCracks(kTolerance, budget, polygons);
  EXPECT_EQ(budget.UsedBytes(), 0U);
  return summary;
}

std::vector<PolygonWithOpenings> Of(const std::vector<Outline>& outlines) {
  std::vector<PolygonWithOpenings> polygons;
  for (const Outline& outline : outlines) {
    polygons.push_back({outline, {}});
  }
  return polygons;
}

const Outline kFloor = {{0, 0, 0}, {4, 0, 0}, {4, 3, 0}, {0, 3, 0}};

TEST(CloseCracks, AWallThatEndsShortOfTheFloorReachesIt) {
  auto polygons =
      Of({kFloor, {{1, 0, 0.002}, {1, 3, 0.001}, {1, 3, 2}, {1, 0, 2}}});
  const CrackSummary summary = Close(polygons);
  const Outline expected = {{1, 0, 0}, {1, 3, 0}, {1, 3, 2}, {1, 0, 2}};
  for (size_t i = 0; i < expected.size(); ++i) {
    EXPECT_LT(Length(polygons[1].outline[i] - expected[i]), kExact);
  }
  EXPECT_EQ(polygons[0].outline, kFloor);
  EXPECT_EQ(summary.moved, 2U);
  EXPECT_NEAR(summary.greatest_move_m, 0.002, kExact);
}

TEST(CloseCracks, WallsInPlanesAMillimetreApartComeIntoOne) {
  auto polygons = Of({{{0, 0, 0}, {4, 0, 0}, {4, 0, 3}, {0, 0, 3}},
                      {{4, 0.001, 0}, {6, 0.0015, 0}, {6, 0, 3}, {4, 0, 3}}});
  Close(polygons);
  ASSERT_EQ(polygons[1].outline.size(), 4U);
  for (const Point3 p : polygons[1].outline) {
    EXPECT_EQ(p.y, 0);
  }
}

// A square of a metre at a random place near the origin.
Outline RandomSquare(uint64_t number) {
  Random random(number);
  const double x = 0.3 * random.Next();
  const double y = 0.3 * random.Next();
  return {{x, y, 0}, {x + 1, y, 0}, {x + 1, y + 1, 0}, {x, y + 1, 0}};
}

TEST(CloseCracks, ThePlaneOfManyInOnePlaceIsNotedOnce) {
#ifndef ENFILADE_JEMALLOC
  GTEST_SKIP() << "sanitizers keep what is freed";
#endif
  std::vector<Outline> outlines;
  for (uint64_t i = 0; i < 1500; ++i) {
    outlines.push_back(RandomSquare(i));
  }
  auto polygons = Of(outlines);
  const uint64_t before = BeginPeak();
  Close(polygons);
  EXPECT_LT(PeakResidentBytes(), before + (8U << 20));
}

TEST(CloseCracks, PlanesThatDifferAreCharged) {
  // A fan of walls around an axis, each with a corner of its own on it.
  constexpr size_t kCount = 400;
  std::vector<Outline> outlines;
  for (size_t i = 0; i < kCount; ++i) {
    const double turn = 3.0 * static_cast<double>(i) / kCount;
    const double z = 0.02 * static_cast<double>(i);
    const double x = std::cos(turn);
    const double y = std::sin(turn);
    outlines.push_back(
        {{0, 0, -1}, {x, y, -1}, {x, y, 9}, {0, 0, 9}, {0, 0, z}});
  }
  auto polygons = Of(outlines);
  MemoryBudget roomy(uint64_t{1} << 30);
  CloseCracks(kTolerance, roomy, polygons);
  // Each corner on the axis lies in all planes.
  EXPECT_GT(roomy.PeakBytes(),
            kCount * 5 * 400 + kCount * kCount * sizeof(uint32_t));
}

TEST(CloseCracks, AnOpeningStaysInThePlaneOfItsWall) {
  std::vector<PolygonWithOpenings> polygons = {
      {{{1, 0, 0}, {1, 3, 0}, {1, 3, 2}, {1, 0, 2}},
       {{{1.001, 1, 0.001}, {0.999, 2, 0}, {1, 2, 1.5}, {1, 1, 1.5}}}},
      {kFloor, {}}};
  Close(polygons);
  const Outline& opening = polygons[0].openings[0];
  for (const Point3 p : opening) {
    EXPECT_NEAR(p.x, 1, kExact);
  }
  EXPECT_NEAR(opening[0].z, 0, kExact);
}

// Both polygons lie in one plane, and no other plane tells where they meet.
TEST(CloseCracks, AVertexOnTheEdgeOfACoplanarPolygonIsAVertexOfBoth) {
  auto polygons =
      Of({kFloor, {{1, 3.002, 0}, {2, 3.002, 0}, {2, 5, 0}, {1, 5, 0}}});
  const CrackSummary summary = Close(polygons);
  EXPECT_EQ(summary.added, 2U);
  for (const size_t i : {0U, 1U}) {
    const Outline& floor = polygons[0].outline;
    EXPECT_EQ(std::count(floor.begin(), floor.end(), polygons[1].outline[i]),
              1);
  }
}

TEST(CloseCracks, WhatIsApartStaysApart) {
  const std::vector<Outline> outlines = {
      kFloor,
      {{1, 0, 0.01}, {1, 3, 0.01}, {1, 3, 2}, {1, 0, 2}},
      {{0, 0, 0.02}, {4, 0, 0.02}, {4, 3, 0.02}, {0, 3, 0.02}}};
  auto polygons = Of(outlines);
  const CrackSummary summary = Close(polygons);
  EXPECT_EQ(summary.moved, 0U);
  for (size_t i = 0; i < outlines.size(); ++i) {
    EXPECT_EQ(polygons[i].outline, outlines[i]);
  }
}

// The walls, floors and ceilings of a row of rooms, alternately of two depths,
// turned by a random angle, each vertex rounded to a millimetre: every joint is
// a T-junction.
std::vector<Outline> RoundedRooms(uint64_t seed) {
  Random random(MixKey(seed, 1));
  const double turn = 6 * random.Next();
  const auto place = [&](double x, double y, double z) {
    const auto round = [](double v) { return std::round(1e3 * v) / 1e3; };
    return Point3{round(x * std::cos(turn) - y * std::sin(turn)),
                  round(x * std::sin(turn) + y * std::cos(turn)),
                  round(z)};
  };
  std::vector<Outline> outlines;
  const auto add = [&](Point3 l, Vec3 u, Vec3 v) {
    Outline outline;
    for (const Point3 p : {l, l + u, l + u + v, l + v}) {
      outline.push_back(place(p.x, p.y, p.z));
    }
    outlines.push_back(outline);
  };
  constexpr int kRooms = 4;
  for (int i = 0; i <= kRooms; ++i) {
    add({3.1 * i, 0, 0}, {0, 4, 0}, {0, 0, 3});
  }
  for (int i = 0; i < kRooms; ++i) {
    const double x = 3.1 * i;
    add({x, 0, 0}, {3.1, 0, 0}, {0, 0, 3});
    add({x, 4, 0}, {3.1, 0, 0}, {0, 0, 3});
    for (const double z : {0.0, 3.0}) {
      add({x, 0, z}, {3.1, 0, 0}, {0, 1.3 + i % 2, 0});
      add({x, 1.3 + i % 2, z}, {3.1, 0, 0}, {0, 2.7 - i % 2, 0});
    }
  }
  return outlines;
}

double DistanceToPlane(Point3 p, const Outline& outline) {
  return Dot(p - outline[0], Normalize(AreaVector(outline)));
}

bool IsAbove(Point3 p, const Outline& outline, double margin) {
  const Vec3 normal = Normalize(AreaVector(outline));
  for (size_t i = 0; i < outline.size(); ++i) {
    const Point3 a = outline[i];
    const Vec3 edge = outline[(i + 1) % outline.size()] - a;
    if (Dot(Cross(normal, edge), p - a) < -margin * Length(edge)) {
      return false;
    }
  }
  return true;
}

TEST(CloseCracks, PolygonsOfRoundedRoomsBecomePlanarAndTouchExactly) {
  for (uint64_t seed = 0; seed < 20; ++seed) {
    SCOPED_TRACE(seed);
    auto polygons = Of(RoundedRooms(seed));
    const CrackSummary summary = Close(polygons);
    EXPECT_GT(summary.moved, 0U);
    EXPECT_LE(summary.greatest_move_m, 4 * kTolerance);
    for (const auto& [outline, openings] : polygons) {
      for (const auto& [other, more] : polygons) {
        for (const Point3 p : other) {
          const double off = std::abs(DistanceToPlane(p, outline));
          EXPECT_FALSE(IsAbove(p, outline, kTolerance) && off < kTolerance &&
                       off > kExact)
              << off;
        }
      }
    }
  }
}

TEST(SnapPlanes, APolygonNearALargerOnesPlaneLiesInIt) {
  const std::vector<Outline> polygons = {
      {{5, 0, 0.001}, {6, 0, 0}, {6, 1, 0}, {5, 1, -0.001}},
      kFloor,
      {{0, 0, 1}, {1, 0, 1}, {1, 1, 1}}};
  const SnappedPlanes snapped = SnapPlanes(polygons, kTolerance);
  ASSERT_EQ(snapped.planes.size(), 2U);
  EXPECT_EQ(snapped.plane_of, (std::vector<uint32_t>{0, 0, 1}));
  EXPECT_EQ(snapped.planes[0].normal, (Vec3{0, 0, 1}));
}

TEST(SnapPlanes, NearlySquareWallsAreMadeSquare) {
  const std::vector<Outline> polygons = {
      {{0, 0, 0}, {4, 3, 0}, {4, 3, 3}, {0, 0, 3}},
      {{0, 0, 0}, {-1.5, 2.001, 0}, {-1.5, 2.001, 3}, {0, 0, 3}}};
  const SnappedPlanes snapped = SnapPlanes(polygons, kTolerance);
  ASSERT_EQ(snapped.planes.size(), 2U);
  EXPECT_NEAR(
      Dot(snapped.planes[0].normal, snapped.planes[1].normal), 0, 1e-15);
}

TEST(BoxTree, FindsWhatTryingAllFinds) {
  Random random(5);
  const auto box = [&](double size) {
    const Point3 low{random.Next(), random.Next(), random.Next()};
    return Box3{low,
                low + Vec3{size * random.Next(),
                           size * random.Next(),
                           size * random.Next()}};
  };
  std::vector<Box3> boxes;
  for (int i = 0; i < 500; ++i) {
    boxes.push_back(box(0.1));
  }
  const BoxTree tree(boxes);
  for (int i = 0; i < 100; ++i) {
    const Box3 query = box(0.3);
    std::vector<uint32_t> found;
    tree.ForOverlaps(query, [&](uint32_t k) { found.push_back(k); });
    std::sort(found.begin(), found.end());
    std::vector<uint32_t> expected;
    for (uint32_t k = 0; k < boxes.size(); ++k) {
      if (boxes[k].Overlaps(query)) {
        expected.push_back(k);
      }
    }
    EXPECT_EQ(found, expected);
  }
}

}  // namespace
}  // namespace enfilade
