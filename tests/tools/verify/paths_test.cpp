#include "tools/verify/paths.h"

#include "base/random.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "tests/budgets.h"
#include "tests/tools/verify_fake_building.h"
#include <gtest/gtest.h>

namespace enfilade {
namespace {

// Mean and standard error of the first channel over independent repeats.
struct Repeated {
  double mean = 0;
  double standard_error = 0;
};

Repeated Repeat(PathTracer& tracer,
                const Receiver& receiver,
                uint32_t strata,
                GatherMode mode = GatherMode::kPaths) {
  constexpr int kRepeats = 32;
  double sum = 0;
  double squares = 0;
  for (uint64_t k = 0; k < kRepeats; ++k) {
    const double value =
        tracer.Irradiance(std::span(&receiver, 1), k, strata, mode, {})[0][0];
    sum += value;
    squares += value * value;
  }
  const double mean = sum / kRepeats;
  const double variance = squares / kRepeats - mean * mean;
  return {mean, std::sqrt(std::max(0.0, variance) / (kRepeats - 1))};
}

// Five standard errors: one false alarm in 10^5 with the normal quantiles of
// Student's t at 31 degrees of freedom, and the seeds are fixed.
void ExpectWithin(const Repeated& r, double expected) {
  EXPECT_NEAR(r.mean, expected, 5 * r.standard_error + 1e-9);
  EXPECT_LT(r.standard_error, 0.02 * expected);
}

std::vector<Point3> Corners(Point3 o, Vec3 u, Vec3 v) {
  return {o, o + u, o + u + v, o + v};
}

// A lamp of exitance 1 over or beside a reflecting unit square.
class LampScene {
 public:
  LampScene(Point3 lamp_origin, Vec3 lamp_u, Vec3 lamp_v)
      : lamp_(Corners(lamp_origin, lamp_u, lamp_v)) {
    const MaterialId grey = building_.AddMaterial({.5, .5, .5}, {});
    const MaterialId light = building_.AddMaterial({}, {1, 1, 1});
    building_.Add({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, grey);
    building_.Add(lamp_origin, lamp_u, lamp_v, light);
  }

  void ExpectClosedForm(const std::vector<Point3>& points) {
    PathTracer tracer(building_.View(), budget_);
    for (const Point3 x : points) {
      const Receiver receiver{x, {0, 0, 1}};
      const double exact = PolygonIrradiance(x, receiver.normal, lamp_);
      ASSERT_GT(exact, 0);
      ExpectWithin(Repeat(tracer, receiver, 12), exact);
    }
  }

 private:
  FakeBuilding building_;
  MemoryBudget budget_{kModest};
  std::vector<Point3> lamp_;
};

TEST(PathTracerTest, ParallelSquaresGiveTheClosedForm) {
  LampScene scene({0, 0, 1}, {0, 1, 0}, {1, 0, 0});
  scene.ExpectClosedForm({{.5, .5, 0}, {.1, .2, 0}, {.99, .99, 0}});
}

TEST(PathTracerTest, PerpendicularSquaresGiveTheClosedFormUpToTheEdge) {
  LampScene scene({0, 0, 0}, {0, 1, 0}, {0, 0, 1});
  scene.ExpectClosedForm({{.5, .5, 0}, {.01, .5, 0}, {.9, .02, 0}});
}

TEST(PathTracerTest, NearbyLargeLampGivesTheClosedForm) {
  LampScene scene({-1, -1, .01}, {0, 3, 0}, {3, 0, 0});
  scene.ExpectClosedForm({{.5, .5, 0}, {.1, .9, 0}});
}

TEST(PathTracerTest, LampDoesNotEmitFromItsBack) {
  FakeBuilding building;
  const MaterialId light = building.AddMaterial({}, {1, 1, 1});
  building.Add({0, 0, 1}, {1, 0, 0}, {0, 1, 0}, light);
  MemoryBudget budget(kModest);
  PathTracer tracer(building.View(), budget);
  const Receiver receiver{{.5, .5, 0}, {0, 0, 1}};
  const auto h =
      tracer.Irradiance(std::span(&receiver, 1), 1, 8, GatherMode::kPaths, {});
  EXPECT_EQ(h[0], (Rgb{0, 0, 0}));
}

TEST(PathTracerTest, BlockerShadowsTheLampWholly) {
  FakeBuilding building;
  const MaterialId light = building.AddMaterial({}, {1, 1, 1});
  const MaterialId black = building.AddMaterial({}, {});
  building.Add({0, 0, 1}, {0, 1, 0}, {1, 0, 0}, light);
  building.Add({-9, -9, .5}, {20, 0, 0}, {0, 20, 0}, black);
  MemoryBudget budget(kModest);
  PathTracer tracer(building.View(), budget);
  const Receiver receiver{{.5, .5, 0}, {0, 0, 1}};
  const auto h =
      tracer.Irradiance(std::span(&receiver, 1), 1, 8, GatherMode::kPaths, {});
  EXPECT_EQ(h[0], (Rgb{0, 0, 0}));
}

TEST(PathTracerTest, FurnaceGivesItsClosedFormInEveryChannel) {
  FakeBuilding building;
  const Rgb rho{.3, .5, .8};
  building.AddRoom({4, 3, 2}, building.AddMaterial(rho, {1, 2, 3}));
  MemoryBudget budget(kModest);
  PathTracer tracer(building.View(), budget);
  const std::vector<Receiver> receivers(64, {{1, 1, 0}, {0, 0, 1}});
  const auto h = tracer.Irradiance(receivers, 7, 16, GatherMode::kPaths, {});
  for (size_t c = 0; c < kRgbChannels; ++c) {
    const double exact = (1.0 + static_cast<double>(c)) / (1 - rho[c]);
    double sum = 0;
    double squares = 0;
    for (const Rgb& value : h) {
      sum += value[c] / 64;
      squares += value[c] * value[c] / 64;
    }
    const double error = std::sqrt((squares - sum * sum) / 63);
    EXPECT_NEAR(sum, exact, 5 * error) << c;
    EXPECT_LT(error, 0.01 * exact) << c;
  }
}

TEST(PathTracerTest, GatheringAConstantFieldInAClosedRoomGivesTheField) {
  FakeBuilding building;
  building.AddRoom({4, 3, 2}, building.AddMaterial({.5, .5, .5}, {1, 1, 1}));
  building.SetRadiosity([](const Patch&, Point3) { return Rgb{2, 2, 2}; });
  MemoryBudget budget(kModest);
  PathTracer tracer(building.View(), budget);
  ExpectWithin(Repeat(tracer, {{1, 1, 1}, {0, .6, .8}}, 8, GatherMode::kField),
               2);
}

TEST(PathTracerTest, ResultDoesNotDependOnTheBatch) {
  FakeBuilding building;
  building.AddRoom({4, 3, 2}, building.AddMaterial({.5, .6, .7}, {1, 2, 3}));
  MemoryBudget budget(kModest);
  const std::vector<Receiver> receivers(5, {{1, 1, 0}, {0, 0, 1}});
  PathTracer tracer(building.View(), budget);
  const auto at_once =
      tracer.Irradiance(receivers, 3, 5, GatherMode::kPaths, {});
  tracer.SetBatchPaths(7);
  EXPECT_EQ(at_once,
            tracer.Irradiance(receivers, 3, 5, GatherMode::kPaths, {}));
}

// Paths of a building that is traced in parts start in another order.
TEST(PathTracerTest, ResultDoesNotDependOnThePartsOfTheBuilding) {
  FakeBuilding building;
  building.AddRoom({4, 3, 2}, building.AddMaterial({.5, .6, .7}, {1, 2, 3}));
  MemoryBudget budget(kModest);
  std::vector<Receiver> receivers;
  Random random(1);
  for (int i = 0; i < 50; ++i) {
    receivers.push_back({{4 * random.Next(), 3 * random.Next(), 0}, {0, 0, 1}});
  }
  const auto trace = [&](size_t parts) {
    BuildingView view = building.View();
    size_t most_rays = 0;
    view.trace_parts = [&] { return parts; };
    view.trace = [&](std::span<const TraceRay> rays, std::span<TraceHit> hits) {
      most_rays = std::max(most_rays, rays.size());
      building.View().trace(rays, hits);
    };
    PathTracer tracer(view, budget);
    auto result = tracer.Irradiance(receivers, 3, 4, GatherMode::kPaths, {});
    return std::pair(std::move(result), most_rays);
  };
  const auto [whole, rays_of_whole] = trace(1);
  const auto [parts, rays_of_part] = trace(5);
  EXPECT_EQ(whole, parts);
  // A fifth of the receivers have at most two rays for each path.
  EXPECT_LE(5 * rays_of_part, 2 * rays_of_whole);
}

// Each receiver has the paths that it would have alone.
TEST(PathTracerTest, ReceiversHaveTheirOwnNumbersOfPaths) {
  FakeBuilding building;
  building.AddRoom({4, 3, 2}, building.AddMaterial({.5, .6, .7}, {1, 2, 3}));
  MemoryBudget budget(kModest);
  const std::vector<Receiver> receivers(4, {{1, 1, 0}, {0, 0, 1}});
  PathTracer tracer(building.View(), budget);
  tracer.SetBatchPaths(10);
  const std::vector<uint32_t> strata = {2, 5, 1, 3};
  const auto mixed =
      tracer.Irradiance(receivers, 3, strata, GatherMode::kPaths, {});
  for (size_t i = 0; i < strata.size(); ++i) {
    EXPECT_EQ(
        mixed[i],
        tracer.Irradiance(receivers, 3, strata[i], GatherMode::kPaths, {})[i]);
  }
}

// A hundred small lamps of two kinds all over the ceiling.
TEST(PathTracerTest, ManyLampsGiveTheClosedForm) {
  FakeBuilding building;
  const MaterialId dim = building.AddMaterial({}, {1, 1, 1});
  const MaterialId bright = building.AddMaterial({}, {5, 5, 5});
  const Point3 x{5, 5, 0};
  double exact = 0;
  for (int i = 0; i < 100; ++i) {
    const Point3 o{i % 10 * 1.0, i / 10 * 1.0, 2};
    building.Add(o, {0, .5, 0}, {.5, 0, 0}, i % 3 == 0 ? bright : dim);
    exact +=
        (i % 3 == 0 ? 5 : 1) *
        PolygonIrradiance(x, {0, 0, 1}, Corners(o, {0, .5, 0}, {.5, 0, 0}));
  }
  // Room in the tree for all, for some and for none.
  for (const uint64_t budget_bytes : {64ULL << 20, 100000ULL, 3000ULL}) {
    MemoryBudget emitter_budget(kModest);
    const EmitterTree tree(building.View(), emitter_budget, budget_bytes / 12);
    EXPECT_EQ(tree.Emitters().size(),
              std::min<size_t>(100, budget_bytes / 12 / 300));
    MemoryBudget budget(kModest);
    PathTracer tracer(building.View(), budget, budget_bytes / 12);
    ExpectWithin(Repeat(tracer, {x, {0, 0, 1}}, 24), exact);
  }
}

// The walk ends without a choice where no emitter below can contribute, so the
// probabilities sum to the share of the numbers that give a choice.
TEST(EmitterTreeTest, ProbabilitiesAgreeWithChoosing) {
  FakeBuilding building;
  const MaterialId light = building.AddMaterial({}, {1, 1, 1});
  enfilade::Random random(5);
  const auto vec = [&] {
    return Vec3{random.Next() - .5, random.Next() - .5, random.Next() - .5};
  };
  for (int i = 0; i < 37; ++i) {
    building.Add(Point3{} + vec() * 10, vec(), vec(), light);
  }
  MemoryBudget budget(kModest);
  const EmitterTree tree(building.View(), budget, 1 << 20);
  for (int k = 0; k < 50; ++k) {
    const Point3 x = Point3{} + vec() * 8;
    const Vec3 n = Normalize(vec());
    double sum = 0;
    for (const Emitter& e : tree.Emitters()) {
      sum += tree.Density(x, n, e.cell, e.patch) * e.area;
    }
    constexpr int kGrid = 4096;
    int chosen = 0;
    for (int i = 0; i < kGrid; ++i) {
      const auto choice = tree.Choose(x, n, (i + .5) / kGrid);
      if (choice) {
        ++chosen;
        const Emitter& e = *choice->emitter;
        EXPECT_DOUBLE_EQ(tree.Density(x, n, e.cell, e.patch) * e.area,
                         choice->probability);
      }
    }
    // Every emitter owns one interval of the numbers.
    EXPECT_NEAR(sum, chosen * 1.0 / kGrid, 37.0 / kGrid);
    EXPECT_LE(sum, 1 + 1e-12);
  }
}

// Every emitter that can send light to the point has a chance to be chosen:
// zero counter-examples allowed.
TEST(EmitterTreeTest, EveryEmitterThatCanContributeHasAChance) {
  FakeBuilding building;
  const MaterialId light = building.AddMaterial({}, {1, 1, 1});
  enfilade::Random random(6);
  const auto vec = [&] {
    return Vec3{random.Next() - .5, random.Next() - .5, random.Next() - .5};
  };
  for (int i = 0; i < 50; ++i) {
    building.Add(Point3{} + vec() * 10, vec(), vec(), light);
  }
  MemoryBudget budget(kModest);
  const EmitterTree tree(building.View(), budget, 1 << 20);
  int seen = 0;
  for (int k = 0; k < 2000; ++k) {
    const Point3 x = Point3{} + vec() * 12;
    const Vec3 n = Normalize(vec());
    for (const Emitter& e : tree.Emitters()) {
      const Vec3 d = (e.origin + e.u * random.Next() + e.v * random.Next()) - x;
      if (Dot(d, n) > 0 && Dot(d, e.normal) < 0) {
        ++seen;
        ASSERT_GT(tree.Density(x, n, e.cell, e.patch), 0);
      }
    }
  }
  EXPECT_GT(seen, 10000);
}

}  // namespace
}  // namespace enfilade
