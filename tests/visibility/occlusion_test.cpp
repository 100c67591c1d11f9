#include "visibility/occlusion.h"

#include "base/error.h"
#include "base/parallel.h"
#include "base/random.h"

#include "tests/budgets.h"
#include "tests/visibility/test_rooms.h"
#include <gtest/gtest.h>
#include <unistd.h>

namespace enfilade {
namespace {

using test::Append;
using test::BoxPatches;
using test::RandomPoint;
using test::Rectangle;

void SetSegment(SegmentPacket& packet, Point3 from, Point3 to) {
  const uint32_t i = packet.count++;
  packet.from_x[i] = static_cast<float>(from.x);
  packet.from_y[i] = static_cast<float>(from.y);
  packet.from_z[i] = static_cast<float>(from.z);
  packet.to_x[i] = static_cast<float>(to.x);
  packet.to_y[i] = static_cast<float>(to.y);
  packet.to_z[i] = static_cast<float>(to.z);
}

bool Blocked(const RayBlockers& blockers, Point3 from, Point3 to) {
  SegmentPacket packet;
  SetSegment(packet, from, to);
  const std::array<const RayBlockers*, 1> all = {&blockers};
  return Occluded(all, packet) == 1;
}

// A 10 m room with small boxes strewn in it.
CellPatches Furnished(int boxes, uint64_t seed) {
  CellPatches cell;
  cell.bounds = {{0, 0, 0}, {10, 10, 10}};
  cell.patches = BoxPatches(cell.bounds, true);
  Random random(seed);
  for (int i = 0; i < boxes; ++i) {
    const Point3 low = RandomPoint(random, 9);
    const Vec3 size{random.Next(), random.Next(), random.Next()};
    Append(cell.patches, BoxPatches({low, low + size}, false));
  }
  return cell;
}

TEST(Occlusion, WallBlocksWhatCrossesItAndNothingElse) {
  MemoryBudget budget(kRoomy);
  const OcclusionDevice device(budget, {});
  CellPatches cell;
  cell.patches = {Rectangle({0, 0, 0}, {1, 0, 0}, {0, 1, 0})};
  const auto wall = device.Build(cell);
  EXPECT_TRUE(Blocked(*wall, {0.3, 0.7, -1}, {0.3, 0.7, 1}));
  EXPECT_TRUE(Blocked(*wall, {0.9, 0.9, 1}, {0.9, 0.9, -1}));
  EXPECT_FALSE(Blocked(*wall, {1.1, 0.7, -1}, {1.1, 0.7, 1}));
  EXPECT_FALSE(Blocked(*wall, {0.3, 0.7, 1}, {0.3, 0.7, 0.5}));
}

// A face of a wall lies just in front of another, since corners are a little
// off: the one behind must not be seen from afar and hidden from near by.
TEST(Occlusion, ASurfaceJustBeforeAnotherHidesItFromAnyDistance) {
  MemoryBudget budget(kRoomy);
  const OcclusionDevice device(budget, {});
  CellPatches cell;
  cell.patches = {Rectangle({-1, -1, 2.5e-4}, {2, 0, 0}, {0, 2, 0})};
  const auto cover = device.Build(cell);
  for (const double distance : {0.1, 1.0, 10.0, 20.0, 50.0}) {
    EXPECT_TRUE(Blocked(*cover, {0, 0, 0}, {0, 0, distance})) << distance;
  }
}

TEST(Occlusion, TriangleBlocksOnlyItsHalfOfTheParallelogram) {
  MemoryBudget budget(kRoomy);
  const OcclusionDevice device(budget, {});
  CellPatches cell;
  cell.patches = {test::Triangle({0, 0, 0}, {1, 0, 0}, {0, 1, 0})};
  const auto half = device.Build(cell);
  EXPECT_TRUE(Blocked(*half, {0.2, 0.2, -1}, {0.2, 0.2, 1}));
  EXPECT_FALSE(Blocked(*half, {0.8, 0.8, -1}, {0.8, 0.8, 1}));
}

TEST(Occlusion, TwinIsNoSecondBlocker) {
  MemoryBudget budget(kRoomy);
  const OcclusionDevice device(budget, {});
  CellPatches one;
  one.patches = {Rectangle({0, 0, 0}, {1, 0, 0}, {0, 1, 0})};
  CellPatches two;
  test::AppendTwoSided(two.patches, one.patches[0]);
  EXPECT_EQ(BlockersBytes(*device.Build(one)),
            BlockersBytes(*device.Build(two)));
}

TEST(Occlusion, EmptyCellBlocksNothing) {
  MemoryBudget budget(kRoomy);
  const OcclusionDevice device(budget, {});
  const auto empty = device.Build({});
  EXPECT_FALSE(Blocked(*empty, {0, 0, 0}, {1, 1, 1}));
}

// Segments between points of the walls of an empty room, near edges too: the
// walls must not block those that leave them steeper than 1 in 20.
TEST(Occlusion, WallsDoNotBlockSegmentsBetweenTheirOwnPoints) {
  MemoryBudget budget(kRoomy);
  const Point3 origin{500, 300, 0};
  const OcclusionDevice device(budget, origin);
  CellPatches room;
  room.patches = BoxPatches({{531.3, 317.7, 3.1}, {538.4, 329.2, 5.8}}, true);
  const auto walls = device.Build(room);
  Random random(1);
  int tried = 0;
  for (int i = 0; i < 20000; ++i) {
    const Patch& p = room.patches[random.NextBelow(6)];
    const Patch& q = room.patches[random.NextBelow(6)];
    const double s = i % 2 == 0 ? 1 : 0.01;  // half of them near an edge
    const Point3 from =
        p.origin + p.u * random.Next() + p.v * (s * random.Next());
    const Point3 to =
        q.origin + q.u * (s * random.Next()) + q.v * random.Next();
    const Vec3 d = Normalize(to - from);
    if (Dot(d, PatchNormal(p)) > 0.05 && -Dot(d, PatchNormal(q)) > 0.05) {
      ++tried;
      ASSERT_FALSE(
          Blocked(*walls, Point3{} + (from - origin), Point3{} + (to - origin)))
          << "segment " << i;
    }
  }
  EXPECT_GT(tried, 5000);
}

// Rounding moves points of oblique surfaces by a fraction of a millimetre
// there.
TEST(Occlusion, ObliqueWallsAKilometreAwayDoNotBlockTheirOwnPoints) {
  MemoryBudget budget(kRoomy);
  const OcclusionDevice device(budget, {});
  Random random(5);
  int blocked = 0;
  constexpr int kSegments = 2000;
  for (int i = 0; i < kSegments; ++i) {
    const auto next = [&] { return 2 * random.Next() - 1; };
    const Point3 corner{1000 * next(), 1000 * next(), 1000 * next()};
    const Vec3 u = Normalize(Vec3{next(), next(), next()}) * 3;
    const Vec3 v = Normalize(Cross(u, Vec3{next(), next(), next()})) * 3;
    CellPatches cell;
    cell.patches = {Rectangle(corner, u, v)};
    const auto wall = device.Build(cell);
    const Point3 on = corner + u * random.Next() + v * random.Next();
    const Vec3 normal = Normalize(Cross(u, v));
    blocked += Blocked(*wall, on, on + normal * 0.8 + u) ? 1 : 0;
  }
  EXPECT_LT(blocked, kSegments / 100);
}

TEST(Occlusion, ContactShadowOneMillimetreAboveTheFloorIsSeen) {
  MemoryBudget budget(kRoomy);
  const OcclusionDevice device(budget, {});
  CellPatches cell;
  cell.patches = {Rectangle({0, 0, 0}, {4, 0, 0}, {0, 4, 0}),
                  Rectangle({1, 1, 0.001}, {1, 0, 0}, {0, 1, 0})};
  const auto floor_and_tile = device.Build(cell);
  EXPECT_TRUE(Blocked(*floor_and_tile, {1.5, 1.5, 0}, {1.5, 1.5, 3}));
  EXPECT_TRUE(Blocked(*floor_and_tile, {1.5, 1.5, 3}, {1.5, 1.5, 0}));
  EXPECT_FALSE(Blocked(*floor_and_tile, {2.5, 1.5, 0}, {2.5, 1.5, 3}));
}

// 16 segments against all cells give the bits that one segment at a time
// against one cell gives.
TEST(Occlusion, PacketOverCellsEqualsSegmentsOneByOne) {
  MemoryBudget budget(kRoomy);
  const OcclusionDevice device(budget, {});
  const auto first = device.Build(Furnished(20, 2));
  const auto second = device.Build(Furnished(20, 3));
  const std::array<const RayBlockers*, 2> both = {first.get(), second.get()};
  Random random(4);
  int blocked_segments = 0;
  for (int i = 0; i < 500; ++i) {
    SegmentPacket packet;
    std::array<std::array<Point3, 2>, 16> ends;
    const uint32_t count = 1 + random.NextBelow(16);
    for (uint32_t k = 0; k < count; ++k) {
      ends[k] = {RandomPoint(random, 10), RandomPoint(random, 10)};
      SetSegment(packet, ends[k][0], ends[k][1]);
    }
    const uint32_t bits = Occluded(both, packet);
    EXPECT_EQ(bits >> 15 >> 1, 0U);
    for (uint32_t k = 0; k < count; ++k) {
      const bool expected = Blocked(*first, ends[k][0], ends[k][1]) ||
                            Blocked(*second, ends[k][0], ends[k][1]);
      ASSERT_EQ(((bits >> k) & 1) != 0, expected);
      blocked_segments += expected ? 1 : 0;
    }
  }
  EXPECT_GT(blocked_segments, 500);
}

TEST(Occlusion, TracedRaysCountsSegments) {
  MemoryBudget budget(kRoomy);
  const OcclusionDevice device(budget, {});
  const auto cell = device.Build(Furnished(1, 5));
  const uint64_t before = TracedRays();
  Blocked(*cell, {1, 1, 1}, {2, 2, 2});
  EXPECT_EQ(TracedRays() - before, 1U);
}

TEST(Occlusion, BuildChargesTheBudgetAndReleasesIt) {
  MemoryBudget budget(kRoomy);
  const OcclusionDevice device(budget, {});
  const uint64_t before = budget.UsedBytes();
  auto cell = device.Build(Furnished(500, 6));
  const uint64_t held = budget.UsedBytes() - before;
  EXPECT_GT(held, 3000U * 64);  // the corners alone take 48 bytes
  EXPECT_NEAR(static_cast<double>(BlockersBytes(*cell)),
              static_cast<double>(held),
              4096);
  cell.reset();
  EXPECT_EQ(budget.UsedBytes(), before);
}

TEST(Occlusion, BlockersTakeNoMoreThanForeseenAndNotFarLess) {
  for (const int boxes : {1, 10, 100, 1000, 5000}) {
    const CellPatches cell = Furnished(boxes, 9);
    MemoryBudget budget(kRoomy);
    const OcclusionDevice device(budget, {});
    const uint64_t before = budget.UsedBytes();
    const auto built = device.Build(cell);
    const uint64_t held = budget.UsedBytes() - before;
    const uint64_t peak = budget.PeakBytes() - before;
    const size_t blockers = BlockerCount(cell);
    EXPECT_LE(held, BlockersHeldBytes(blockers)) << boxes;
    EXPECT_LE(peak, BlockersBuildBytes(blockers)) << boxes;
    if (boxes >= 100) {
      EXPECT_GE(2 * held, BlockersHeldBytes(blockers)) << boxes;
      EXPECT_GE(2 * peak, BlockersBuildBytes(blockers)) << boxes;
    }
  }
}

TEST(Occlusion, BuildThatDoesNotFitThrowsAndLeavesTheDeviceUsable) {
  MemoryBudget budget(1 << 20);
  const OcclusionDevice device(budget, {});
  const uint64_t before = budget.UsedBytes();
  EXPECT_THROW(static_cast<void>(device.Build(Furnished(5000, 7))),
               DoesNotFitError);
  EXPECT_EQ(budget.UsedBytes(), before);
  const auto small = device.Build(Furnished(1, 8));
  EXPECT_TRUE(Blocked(*small, {1, 1, 1}, {-1, 1, 1}));
}

// Embree 3.13.5 can hang on AVX-512 in compact robust scenes: an alarm kills
// the test then.
TEST(Occlusion, PacketsEndWithinTheAlarm) {
  alarm(60);
  MemoryBudget budget(kRoomy);
  const OcclusionDevice device(budget, {});
  const auto cell = device.Build(Furnished(2000, 9));
  const std::array<const RayBlockers*, 1> all = {cell.get()};
  std::vector<uint32_t> bits(20000);
  const auto trace = [&](size_t i) {
    Random random(i);
    SegmentPacket packet;
    for (int k = 0; k < 16; ++k) {
      SetSegment(packet, RandomPoint(random, 10), RandomPoint(random, 10));
    }
    bits[i] = Occluded(all, packet);
  };
  ParallelFor(bits.size(), trace);
  const std::vector<uint32_t> parallel_bits = bits;
  const ThreadLimit one(1);
  ParallelFor(bits.size(), trace);
  EXPECT_EQ(bits, parallel_bits);
  alarm(0);
}

}  // namespace
}  // namespace enfilade
