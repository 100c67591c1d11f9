// The interval of verify covers the truth as often as it says, where light is
// uneven and the error is anywhere.

#include "base/random.h"

#include <cmath>

#include "tests/tools/verify_fake_building.h"
#include "tools/verify/measure.h"
#include <gtest/gtest.h>

namespace enfilade {
namespace {

constexpr int kManySeeds = 300;

// 92 % of 300. At the nominal 95 %, fewer covered intervals have a probability
// of 0.6 %.
constexpr int kLeastCoveredOfMany = 276;

constexpr int kFloorGrid = 128;
constexpr double kSize = 4;  // of the floor, in metres

// A floor, grey, with a wide dim lamp 2 m above it and a small lamp a hundred
// times as bright that stands on its edge. Both are black: the floor's
// radiosity has a closed form.
double Exact(Point3 x) {
  const std::vector<Point3> wide{{1, 1, 2}, {1, 3, 2}, {3, 3, 2}, {3, 1, 2}};
  const std::vector<Point3> bright{
      {0, 1, .1}, {0, 1.2, .1}, {0, 1.2, .3}, {0, 1, .3}};
  return .5 * (PolygonIrradiance(x, {0, 0, 1}, wide) +
               100 * PolygonIrradiance(x, {0, 0, 1}, bright));
}

// A relative error: a square wave all over, and one more in a disc.
struct Planted {
  double wave = 0;
  double disc = 0;
  double radius = 0;
  Point3 center;

  explicit Planted(uint64_t seed) {
    enfilade::Random random(MixKey(99, seed));
    wave = .1 + .1 * random.Next();
    disc = random.Next() - .5;
    radius = .3 + random.Next();
    center = {kSize * random.Next(), kSize * random.Next(), 0};
  }

  [[nodiscard]] double At(Point3 x) const {
    const bool odd =
        std::fmod(std::floor(x.x * 4) + std::floor(x.y * 4), 2) != 0;
    return (odd ? wave : -wave) + (Length(x - center) < radius ? disc : 0);
  }
};

// The error by the midpoint rule.
double ExactError(const Planted& planted, const std::vector<double>& exact) {
  double squares = 0;
  double mean = 0;
  for (int i = 0; i < kFloorGrid * kFloorGrid; ++i) {
    const Point3 x{(i % kFloorGrid + .5) * kSize / kFloorGrid,
                   (i / kFloorGrid + .5) * kSize / kFloorGrid,
                   0};
    const double b = exact[static_cast<size_t>(i)];
    const double d = b * planted.At(x);
    squares += d * d / (kFloorGrid * kFloorGrid);
    mean += b / (kFloorGrid * kFloorGrid);
  }
  return std::sqrt(squares) / mean;
}

TEST(VerifyCoverageTest, PlantedErrorsUnderUnevenLampsAreCovered) {
  FakeBuilding building;
  const MaterialId grey = building.AddMaterial({.5, .5, .5}, {});
  building.Add({0, 0, 0}, {kSize, 0, 0}, {0, kSize, 0}, grey);
  building.Add(
      {1, 1, 2}, {0, 2, 0}, {2, 0, 0}, building.AddMaterial({}, {1, 1, 1}));
  building.Add({0, 1, .1},
               {0, .2, 0},
               {0, 0, .2},
               building.AddMaterial({}, {100, 100, 100}));
  std::vector<double> exact;
  for (int i = 0; i < kFloorGrid * kFloorGrid; ++i) {
    exact.push_back(Exact({(i % kFloorGrid + .5) * kSize / kFloorGrid,
                           (i / kFloorGrid + .5) * kSize / kFloorGrid,
                           0}));
  }
  int covered = 0;
  int above = 0;  // truth above the upper end
  double width = 0;
  for (uint64_t seed = 1; seed <= kManySeeds; ++seed) {
    const Planted planted(seed);
    building.SetRadiosity([&](const Patch&, Point3 x) {
      const double b = Exact(x) * (1 + planted.At(x));
      return Rgb{b, b, b};
    });
    VerifyOptions options;
    options.seed = seed;
    options.points_per_round = 256;
    options.max_rounds = 1;
    MemoryBudget budget(64ULL << 20);
    const VerifySummary s = MeasureError(building.View(), options, budget);
    const double truth = ExactError(planted, exact);
    covered += s.error_low <= truth && truth <= s.error_high ? 1 : 0;
    above += truth > s.error_high ? 1 : 0;
    width += (s.error_high - s.error_low) / 2 / truth / kManySeeds;
  }
  EXPECT_GE(covered, kLeastCoveredOfMany);
  EXPECT_LE(above, kManySeeds - kLeastCoveredOfMany);
  // The intervals do not cover the truth by being wide.
  EXPECT_LE(width, .35);
}

}  // namespace
}  // namespace enfilade
