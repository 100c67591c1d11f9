#include "tools/verify/measure.h"

#include "base/error.h"
#include "base/random.h"

#include <cmath>

#include "tests/budgets.h"
#include "tests/tools/verify_fake_building.h"
#include "tools/verify/estimate.h"
#include <gtest/gtest.h>

namespace enfilade {
namespace {

constexpr int kSeeds = 40;

// Of 40 intervals that hold the truth with probability 0.95 each, fewer than
// this many do with probability 0.003.
constexpr int kLeastCovered = 34;

VerifyOptions QuickOptions(uint64_t seed) {
  VerifyOptions options;
  options.seed = seed;
  options.points_per_round = 256;
  options.max_rounds = 1;
  return options;
}

// A unit square under a lamp of the same size at distance 1. The lamp is
// black, so that the square's radiosity has a closed form.
class UnderALamp {
 public:
  // The solution is the truth times 1 + deviation(position).
  explicit UnderALamp(std::function<double(Point3)> deviation) {
    const MaterialId grey = building_.AddMaterial({.8, .5, .2}, {});
    const MaterialId light = building_.AddMaterial({}, {1, 1, 1});
    building_.Add({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, grey);
    building_.Add({0, 0, 1}, {0, 1, 0}, {1, 0, 0}, light);
    building_.SetRadiosity([deviation](const Patch&, Point3 x) {
      const double b = Exact(x) * (1 + deviation(x));
      return Rgb{.8 * b, .5 * b, .2 * b};
    });
  }

  [[nodiscard]] VerifySummary Measure(const VerifyOptions& options) const {
    MemoryBudget budget(kModest);
    return MeasureError(building_.View(), options, budget);
  }

  // The error by a fine midpoint rule.
  static double ExactError(const std::function<double(Point3)>& deviation) {
    constexpr int kGrid = 200;
    double squares = 0;
    double mean = 0;
    for (int i = 0; i < kGrid * kGrid; ++i) {
      const Point3 x{(i % kGrid + .5) / kGrid, (i / kGrid + .5) / kGrid, 0};
      const double b = Exact(x);
      const double d = b * deviation(x);
      squares += d * d * (.64 + .25 + .04) / 3 / (kGrid * kGrid);
      mean += b * .5 / (kGrid * kGrid);
    }
    return std::sqrt(squares) / mean;
  }

 private:
  static double Exact(Point3 x) {
    return PolygonIrradiance(
        x, {0, 0, 1}, {{0, 0, 1}, {0, 1, 1}, {1, 1, 1}, {1, 0, 1}});
  }

  FakeBuilding building_;
};

void ExpectCovered(const std::function<double(Point3)>& deviation) {
  const UnderALamp scene(deviation);
  const double exact = UnderALamp::ExactError(deviation);
  int covered = 0;
  double mean = 0;  // of the squared errors, which are unbiased
  double mean_square = 0;
  for (uint64_t seed = 1; seed <= kSeeds; ++seed) {
    const VerifySummary s = scene.Measure(QuickOptions(seed));
    covered += s.error_low <= exact && exact <= s.error_high ? 1 : 0;
    const double square = s.error * s.error;
    mean += square / kSeeds;
    mean_square += square * square / kSeeds;
  }
  EXPECT_GE(covered, kLeastCovered);
  const double off = 5 * std::sqrt((mean_square - mean * mean) / kSeeds);
  EXPECT_NEAR(mean, exact * exact, off);
  EXPECT_LT(off, 0.2 * exact * exact) << "or this would say little";
}

TEST(VerifyTest, ASquareWaveOfFivePercentIsMeasuredAsSuch) {
  ExpectCovered([](Point3 x) {
    return std::fmod(std::floor(x.x * 8) + std::floor(x.y * 8), 2) == 0 ? .05
                                                                        : -.05;
  });
}

TEST(VerifyTest, AnErrorInAnEighthOfTheAreaIsMeasuredAsSuch) {
  ExpectCovered([](Point3 x) { return x.x < .5 && x.y < .25 ? .2 : 0; });
}

TEST(VerifyTest, ASolutionOfFivePercentTooDarkHasThatDeviation) {
  const UnderALamp scene([](Point3) { return -.05; });
  int covered = 0;
  for (uint64_t seed = 1; seed <= kSeeds; ++seed) {
    const VerifySummary s = scene.Measure(QuickOptions(seed));
    covered +=
        s.mean_deviation_low <= -.05 && -.05 <= s.mean_deviation_high ? 1 : 0;
  }
  EXPECT_GE(covered, kLeastCovered);
}

// The noise of the reference must not be taken for error of the solution: one
// path more or less is off by about 100 %.
TEST(VerifyTest, TheExactSolutionHasNoError) {
  const UnderALamp scene([](Point3) { return 0; });
  int covered = 0;
  double mean_square = 0;
  for (uint64_t seed = 1; seed <= kSeeds; ++seed) {
    const VerifySummary s = scene.Measure(QuickOptions(seed));
    covered += s.error_low == 0 ? 1 : 0;
    EXPECT_LT(s.error_high, 0.05);
    mean_square += s.error * s.error / kSeeds;
  }
  EXPECT_GE(covered, kLeastCovered);
  EXPECT_LT(std::sqrt(mean_square), 0.01);
}

TEST(VerifyTest, FurnaceIsMeasuredAgainstItsClosedForm) {
  FakeBuilding building;
  building.AddRoom({4, 3, 2}, building.AddMaterial({.5, .5, .5}, {1, 1, 1}));
  // B = 2 exactly, 1 of it reflected; off by sqrt(2) * 0.05 on half the area.
  building.SetRadiosity([](const Patch&, Point3 x) {
    const double b = x.x < 2 ? 2 + .05 * std::sqrt(2.0) : 2;
    return Rgb{b, b, b};
  });
  MemoryBudget budget(kModest);
  VerifyOptions options;
  options.points_per_round = 1024;
  const VerifySummary s = MeasureError(building.View(), options, budget);
  EXPECT_TRUE(s.tight);
  EXPECT_NEAR(s.error, .05, .0025 * 2);
  EXPECT_NEAR(s.mean_reflected, 1, .02);
  EXPECT_DOUBLE_EQ(s.area_m2, 52);
}

TEST(VerifyTest, ATighterTargetGivesATighterInterval) {
  const UnderALamp scene([](Point3 x) { return x.x < .1 ? .2 : 0; });
  VerifyOptions options = QuickOptions(1);
  options.max_rounds = 64;
  options.target_half_width = 0;
  for (const double target : {0.2, 0.05}) {
    options.target_relative_half_width = target;
    const VerifySummary s = scene.Measure(options);
    EXPECT_TRUE(s.tight);
    EXPECT_LE((s.error_high - s.error_low) / 2, target * s.error);
  }
}

// An error in the corner [0, .25] x [0, .25] alone; elsewhere there is noise.
TEST(VerifyTest, TheLargestDifferencesAreWhereTheErrorIs) {
  const UnderALamp scene([](Point3 x) { return x.x < .25 && x.y < .25; });
  const VerifySummary s = scene.Measure(QuickOptions(1));
  ASSERT_EQ(s.largest_differences.size(), 16U);
  double last = 1;
  double sum = 0;
  for (const DifferingPoint& d : s.largest_differences) {
    EXPECT_LT(d.position.x, .25);
    EXPECT_LT(d.position.y, .25);
    EXPECT_EQ(d.position.z, 0);
    EXPECT_EQ(d.normal.z, 1);
    // The solution is twice the truth, which takes paths to know.
    EXPECT_NEAR(d.solution[0] / d.reference[0], 2, .5);
    EXPECT_NEAR(d.reference[0] / d.reference[2], 4, 1e-6);
    EXPECT_GT(d.paths, 0U);
    EXPECT_LE(d.share, last);
    last = d.share;
    sum += d.share;
  }
  EXPECT_GT(sum, .1);
  EXPECT_LT(sum, 1.1);
}

// Many paths for each point are worth their time under a small lamp, but not if
// there is none: then there are two pilots at least, each with few paths, and
// one round.
TEST(VerifyTest, FewPathsWhereThereIsNoTime) {
  const UnderALamp scene([](Point3) { return 1e-3; });
  VerifyOptions options = QuickOptions(1);
  options.target_half_width = 0;
  options.max_seconds = 60;
  const uint64_t at_leisure = scene.Measure(options).paths;
  options.max_seconds = 1e-6;
  const uint64_t in_a_hurry = scene.Measure(options).paths;
  constexpr uint64_t kMostPaths =
      6 * 6;  // of a point: four strata, and two more
  EXPECT_LE(in_a_hurry, 4 * 2 * options.points_per_round * kMostPaths);
  EXPECT_GT(at_leisure, 2 * in_a_hurry);
}

TEST(VerifyTest, SameSeedSameBits) {
  const UnderALamp scene([](Point3 x) { return .1 * x.x; });
  const VerifySummary a = scene.Measure(QuickOptions(3));
  const VerifySummary b = scene.Measure(QuickOptions(3));
  EXPECT_EQ(a.error, b.error);
  EXPECT_EQ(a.error_high, b.error_high);
  EXPECT_NE(a.error, scene.Measure(QuickOptions(4)).error);
}

TEST(VerifyTest, ASceneWithoutLightIsRefused) {
  FakeBuilding building;
  building.AddRoom({1, 1, 1}, building.AddMaterial({.5, .5, .5}, {}));
  building.SetRadiosity([](const Patch&, Point3) { return Rgb{}; });
  MemoryBudget budget(kModest);
  EXPECT_THROW(MeasureError(building.View(), VerifyOptions{}, budget),
               InputError);
}

TEST(VerifyTest, ABlackSceneIsRefused) {
  FakeBuilding building;
  building.AddRoom({1, 1, 1}, building.AddMaterial({}, {1, 1, 1}));
  MemoryBudget budget(kModest);
  EXPECT_THROW(MeasureError(building.View(), VerifyOptions{}, budget),
               InputError);
}

TEST(VerifyTest, NothingIsLeftChargedAfterwards) {
  const UnderALamp scene([](Point3) { return 0; });
  MemoryBudget budget(kModest);
  FakeBuilding building;
  building.AddRoom({1, 1, 1}, building.AddMaterial({.5, .5, .5}, {1, 1, 1}));
  building.SetRadiosity([](const Patch&, Point3) { return Rgb{2, 2, 2}; });
  MeasureError(building.View(), QuickOptions(1), budget);
  EXPECT_EQ(budget.UsedBytes(), 0U);
  EXPECT_GT(budget.PeakBytes(), 0U);
}

TEST(ErrorEstimateTest, NoiselessSamplesGiveTheExactValues) {
  std::vector<ErrorSample> samples(10);
  for (ErrorSample& s : samples) {
    s.reflectance = {.5, .5, .5};
    s.exitance = {3, 3, 3};
    s.irradiance1 = s.irradiance2 = {2, 2, 2};
    s.radiosity = {4.1, 4.1, 4.1};
  }
  ErrorEstimate estimate;
  estimate.AddRound(samples);
  EXPECT_NEAR(estimate.Error().value, .1, 1e-12);
  EXPECT_NEAR(estimate.Error().low, .1, 1e-9);
  // One more of ten samples with the same product, and 1.96 times its
  // deviation.
  EXPECT_NEAR(estimate.Error().high, .1 * std::sqrt(1 + 2.96 / 10), 1e-4);
  EXPECT_NEAR(estimate.Deviation().value, .1, 1e-12);
}

// A sample of half the density counts twice in every mean.
TEST(ErrorEstimateTest, WeightsScaleWhatIsAveraged) {
  std::vector<ErrorSample> samples(8);
  for (size_t i = 0; i < samples.size(); ++i) {
    ErrorSample& s = samples[i];
    s.weight = i < 4 ? 1.5 : .5;
    s.reflectance = {.5, .5, .5};
    s.irradiance1 = s.irradiance2 = {2, 2, 2};
    const double radiosity = i < 4 ? 1.2 : 1;
    s.radiosity = {radiosity, radiosity, radiosity};
  }
  ErrorEstimate estimate;
  estimate.AddRound(samples);
  EXPECT_NEAR(estimate.MeanReflected(), 1, 1e-12);
  EXPECT_NEAR(estimate.Error().value, std::sqrt(.75 * .04), 1e-12);
}

}  // namespace
}  // namespace enfilade
