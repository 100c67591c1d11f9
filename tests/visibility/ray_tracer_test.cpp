#include "visibility/ray_tracer.h"

#include "base/parallel.h"
#include "base/random.h"

#include <optional>

#include "tests/budgets.h"
#include "tests/visibility/map_storage.h"
#include "tests/visibility/test_rooms.h"
#include <gtest/gtest.h>

namespace enfilade {
namespace {

using test::Append;
using test::BoxPatches;
using test::MapStorage;
using test::RandomPoint;
using test::Rectangle;

void PutCell(MapStorage& store, uint32_t id, std::vector<Patch> patches) {
  CellPatches cell;
  cell.patches = std::move(patches);
  for (const Patch& p : cell.patches) {
    cell.bounds.Include(p.origin);
    cell.bounds.Include(p.origin + p.u + p.v);
  }
  store.Put({BlockKind::kCellPatches, id}, EncodeCellPatches(cell));
}

TraceHit TraceOne(const MapStorage& store, const TraceRay& ray) {
  MemoryBudget budget(kRoomy);
  RayTracer tracer(store, budget);
  TraceHit hit;
  tracer.Trace({&ray, 1}, {&hit, 1});
  return hit;
}

void Chunk(MapStorage& store) {
  MemoryBudget budget(kRoomy);
  BuildTraceChunks(store, budget);
}

// Boxes strewn over a cube, all of one size, in 27 cells.
constexpr double kCity = 90;

MapStorage City(int boxes_per_cell) {
  MapStorage store;
  Random random(1);
  for (uint32_t cell = 0; cell < 27; ++cell) {
    std::vector<Patch> patches;
    const Point3 corner{
        30.0 * (cell % 3), 30.0 * (cell / 3 % 3), 30.0 * (cell / 9)};
    for (int i = 0; i < boxes_per_cell; ++i) {
      const Point3 low = corner + (RandomPoint(random, 29) - Point3{});
      const Vec3 size{
          0.1 + random.Next(), 0.1 + random.Next(), 0.1 + random.Next()};
      Append(patches, BoxPatches({low, low + size}, false));
    }
    PutCell(store, cell, std::move(patches));
  }
  Chunk(store);
  return store;
}

std::vector<TraceRay> CityRays(size_t count) {
  std::vector<TraceRay> rays(count);
  for (size_t i = 0; i < count; ++i) {
    Random random(i);
    rays[i].origin = RandomPoint(random, kCity);
    rays[i].direction = RandomPoint(random, kCity) - rays[i].origin;
  }
  return rays;
}

std::vector<TraceHit> TraceAll(const MapStorage& store,
                               const std::vector<TraceRay>& rays,
                               uint64_t budget_bytes) {
  MemoryBudget budget(budget_bytes);
  RayTracer tracer(store, budget);
  std::vector<TraceHit> hits(rays.size());
  tracer.Trace(rays, hits);
  return hits;
}

bool SameHit(const TraceHit& a, const TraceHit& b) {
  return a.hit == b.hit && a.distance == b.distance && a.cell == b.cell &&
         a.patch == b.patch && a.a == b.a && a.b == b.b;
}

// Of two surfaces in one place, rays from the hidden one start below the other;
// and everywhere well above the rounding of a float.
TEST(RayOffset, IsBetweenRoundingAndHiddenSurfaces) {
  for (double size = 0.1; size < 2000; size *= 1.3) {
    const double offset = RayOffset({{0, 0, 0}, {size, size, 0}});
    EXPECT_GE(offset, size * 0x1.0p-23) << size;
    EXPECT_LT(offset, kApartM) << size;
  }
}

TEST(RayTracer, HitHasPatchCoordinatesAndDistanceInLengthsOfTheDirection) {
  MapStorage store;
  PutCell(store,
          3,
          {Rectangle({0, 0, 0}, {2, 0, 0}, {0, 4, 0}),
           test::Triangle({5, 0, 0}, {2, 0, 0}, {0, 4, 0})});
  Chunk(store);
  const TraceHit quad = TraceOne(store, {{0.5, 3, 6}, {0, 0, -2}});
  ASSERT_TRUE(quad.hit);
  EXPECT_EQ(quad.cell, CellId(3U));
  EXPECT_EQ(quad.patch, PatchId(0U));
  EXPECT_NEAR(quad.a, 0.25, 1e-6);
  EXPECT_NEAR(quad.b, 0.75, 1e-6);
  EXPECT_NEAR(quad.distance, 3, 1e-6);
  const TraceHit triangle = TraceOne(store, {{5.5, 1, 6}, {0, 0, -1}});
  ASSERT_TRUE(triangle.hit);
  EXPECT_EQ(triangle.patch, PatchId(1U));
  EXPECT_NEAR(triangle.a, 0.25, 1e-6);
  EXPECT_NEAR(triangle.b, 0.25, 1e-6);
  EXPECT_FALSE(TraceOne(store, {{6.9, 3.9, 6}, {0, 0, -1}}).hit);
}

TEST(RayTracer, QuadHalvesShareTheirCoordinates) {
  MapStorage store;
  PutCell(store, 0, {Rectangle({0, 0, 0}, {1, 0, 0}, {0.3, 1, 0})});
  Chunk(store);
  Random random(3);
  for (int i = 0; i < 200; ++i) {
    const double a = random.Next();
    const double b = random.Next();
    const TraceHit hit = TraceOne(store, {{a + 0.3 * b, b, 1}, {0, 0, -1}});
    ASSERT_TRUE(hit.hit);
    EXPECT_NEAR(hit.a, a, 1e-5);
    EXPECT_NEAR(hit.b, b, 1e-5);
  }
}

TEST(RayTracer, NothingBeyondMaxDistanceIsHit) {
  MapStorage store;
  PutCell(store, 0, {Rectangle({0, 0, 0}, {1, 0, 0}, {0, 1, 0})});
  Chunk(store);
  EXPECT_TRUE(TraceOne(store, {{0.5, 0.5, 2}, {0, 0, -1}, 2.01}).hit);
  EXPECT_FALSE(TraceOne(store, {{0.5, 0.5, 2}, {0, 0, -1}, 1.99}).hit);
}

TEST(RayTracer, OneSidedPatchIsAlsoHitOnItsBack) {
  MapStorage store;
  PutCell(store, 0, {Rectangle({0, 0, 0}, {1, 0, 0}, {0, 1, 0})});
  Chunk(store);
  EXPECT_TRUE(TraceOne(store, {{0.5, 0.5, -2}, {0, 0, 1}}).hit);
}

// A wall whose sides belong to two cells and are cut differently, oblique to
// all axes and far from the origin.
TEST(RayTracer, OfTwoSidesOfAWallTheOneThatFacesTheRayIsHit) {
  const Point3 corner{403.17, 251.93, 17.31};
  const Vec3 u{2.1, 0.7, 0.3};
  const Vec3 v{-0.4, 1.9, 2.2};
  MapStorage store;
  PutCell(store, 1, {Rectangle(corner, u, v)});
  PutCell(store,
          2,
          {Rectangle(corner, v, u * 0.37),
           Rectangle(corner + u * 0.37, v, u * 0.63)});
  Chunk(store);
  const Vec3 n = Normalize(Cross(u, v));
  MemoryBudget budget(kRoomy);
  RayTracer tracer(store, budget);
  int wrong = 0;
  for (int i = 0; i < 5000; ++i) {
    Random random(static_cast<uint64_t>(i));
    const Point3 target = corner + u * (0.05 + 0.9 * random.Next()) +
                          v * (0.05 + 0.9 * random.Next());
    const bool from_front = i % 2 == 0;
    const Vec3 side =
        (u * (random.Next() - 0.5) + v * (random.Next() - 0.5)) * 8;
    const Vec3 away =
        (n * (0.2 + random.Next())) * (from_front ? 1 : -1) + side;
    const TraceRay ray{target + away, -away};
    TraceHit hit;
    tracer.Trace({&ray, 1}, {&hit, 1});
    ASSERT_TRUE(hit.hit);
    EXPECT_NEAR(hit.distance, 1, 1e-3);
    wrong += hit.cell == CellId(from_front ? 1U : 2U) ? 0 : 1;
  }
  EXPECT_EQ(wrong, 0);
}

TEST(RayTracer, BackNearerThanAFrontIsHitFirst) {
  MapStorage store;
  PutCell(store, 0, {Rectangle({0, 0, 0}, {1, 0, 0}, {0, 1, 0})});
  PutCell(store, 1, {Rectangle({0, 0, 0.01}, {0, 1, 0}, {1, 0, 0})});
  Chunk(store);
  const TraceHit hit = TraceOne(store, {{0.5, 0.5, 1}, {0, 0, -1}});
  EXPECT_EQ(hit.cell, CellId(1U));
}

// Distance to the nearest of the parallelograms, 1e30 if there is none.
double NearestByBruteForce(const std::vector<Patch>& patches,
                           const TraceRay& ray) {
  double nearest = 1e30;
  for (const Patch& p : patches) {
    const Vec3 n = Cross(p.u, p.v);
    const double t = Dot(p.origin - ray.origin, n) / Dot(ray.direction, n);
    const Vec3 q = ray.origin + ray.direction * t - p.origin;
    const double a = Dot(q, p.u) / Dot(p.u, p.u);
    const double b = Dot(q, p.v) / Dot(p.v, p.v);
    if (t > 0 && a >= 0 && a <= 1 && b >= 0 && b <= 1) {
      nearest = std::min(nearest, t);
    }
  }
  return nearest;
}

TEST(RayTracer, ClosestHitEqualsBruteForceOverAllPatches) {
  const MapStorage store = City(300);
  std::vector<Patch> patches;
  for (uint32_t c = 0; c < 27; ++c) {
    Append(patches, LoadCellPatches(store, CellId(c)).patches);
  }
  const std::vector<TraceRay> rays = CityRays(400);
  const std::vector<TraceHit> hits = TraceAll(store, rays, kRoomy);
  int hit_count = 0;
  for (size_t i = 0; i < rays.size(); ++i) {
    const double nearest = NearestByBruteForce(patches, rays[i]);
    ASSERT_EQ(hits[i].hit, nearest < 1e30);
    if (hits[i].hit) {
      ++hit_count;
      EXPECT_NEAR(hits[i].distance * Length(rays[i].direction),
                  nearest * Length(rays[i].direction),
                  1e-4);
    }
  }
  EXPECT_GT(hit_count, 100);
}

TEST(RayTracer, SameBitsWhateverTheBudgetAndTheThreads) {
  const MapStorage store = City(1000);
  EXPECT_GT(store.Count(BlockKind::kTrace), 15U);
  const std::vector<TraceRay> rays = CityRays(20000);
  const std::vector<TraceHit> all = TraceAll(store, rays, kRoomy);
  const std::vector<TraceHit> few = TraceAll(store, rays, 16 << 20);
  const ThreadLimit one(1);
  const std::vector<TraceHit> serial = TraceAll(store, rays, 24 << 20);
  for (size_t i = 0; i < rays.size(); ++i) {
    ASSERT_TRUE(SameHit(all[i], few[i])) << i;
    ASSERT_TRUE(SameHit(all[i], serial[i])) << i;
  }
}

TEST(RayTracer, SmallBudgetIsKeptAndLargeBudgetLoadsEachChunkOnce) {
  const MapStorage store = City(1000);
  const std::vector<TraceRay> rays = CityRays(3000);
  std::vector<TraceHit> hits(rays.size());
  MemoryBudget little(12 << 20);
  RayTracer tracer(store, little);
  tracer.Trace(rays, hits);
  EXPECT_LE(little.PeakBytes(), little.LimitBytes());

  MemoryBudget much(kRoomy);
  RayTracer at_once(store, much);
  const uint64_t before = store.Gets();
  at_once.Trace(rays, hits);
  at_once.Trace(rays, hits);
  EXPECT_LE(store.Gets() - before, store.Count(BlockKind::kTrace) - 1);
}

// Walls one behind the other, each in a chunk of its own: the first one stops
// all rays, so that those behind it need not be in memory.
TEST(RayTracer, ChunksBehindAWallAreNotRead) {
  MapStorage store;
  constexpr int kSide = 70;  // squares; two walls exceed a chunk
  for (uint32_t wall = 0; wall < 8; ++wall) {
    std::vector<Patch> patches;
    for (int i = 0; i < kSide * kSide; ++i) {
      const Point3 corner{10.0 * wall,
                          static_cast<double>(i % kSide),
                          static_cast<double>(i / kSide)};
      patches.push_back(Rectangle(corner, {0, 0, 1}, {0, 1, 0}));
    }
    PutCell(store, wall, std::move(patches));
  }
  Chunk(store);
  ASSERT_EQ(store.Count(BlockKind::kTrace), 1U + 8U);
  std::vector<TraceRay> rays(1000);
  for (size_t i = 0; i < rays.size(); ++i) {
    Random random(i);
    const Point3 p = RandomPoint(random, kSide);
    rays[i] = {{-1, p.y, p.z}, {1, 0, 0}};
  }
  MemoryBudget budget(kRoomy);
  RayTracer tracer(store, budget);
  std::vector<TraceHit> hits(rays.size());
  const uint64_t before = store.Gets();
  tracer.Trace(rays, hits);
  EXPECT_EQ(store.Gets() - before, 1U);
  for (const TraceHit& hit : hits) {
    ASSERT_TRUE(hit.hit);
    EXPECT_EQ(hit.cell, CellId(0U));
  }
}

TEST(RayTracer, PartsOfABuildingFitTheMemory) {
  const MapStorage store = City(1000);
  MemoryBudget much(kRoomy);
  EXPECT_EQ(RayTracer(store, much).Parts(), 1U);
  MemoryBudget little(12 << 20);
  const size_t parts = RayTracer(store, little).Parts();
  EXPECT_GT(parts, 1U);
  EXPECT_LE(parts, store.Count(BlockKind::kTrace) - 1);
}

// Rays start in the middle of a closed room of many patches: even at shared
// edges only a few in a hundred thousand escape.
TEST(RayTracer, ClosedRoomHardlyLeaks) {
  MapStorage store;
  std::vector<Patch> patches;
  for (const Patch& wall :
       BoxPatches({{100.3, 50.7, 3.1}, {107.4, 59.9, 5.8}}, true)) {
    constexpr int kCuts = 13;
    for (int i = 0; i < kCuts * kCuts; ++i) {
      patches.push_back(Rectangle(wall.origin + wall.u * (i % kCuts / 13.0) +
                                      wall.v * (i / kCuts / 13.0),
                                  wall.u / kCuts,
                                  wall.v / kCuts));
    }
  }
  PutCell(store, 0, std::move(patches));
  Chunk(store);
  std::vector<TraceRay> rays(100000);
  for (size_t i = 0; i < rays.size(); ++i) {
    Random random(i);
    rays[i] = {{103, 55, 4}, RandomPoint(random, 2) - Point3{1, 1, 1}};
  }
  int leaks = 0;
  for (const TraceHit& hit : TraceAll(store, rays, kRoomy)) {
    leaks += hit.hit ? 0 : 1;
  }
  EXPECT_LE(leaks, 5);
}

}  // namespace
}  // namespace enfilade
