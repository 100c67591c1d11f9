// What many probes say together of known residuals.

#include "solver/residual/residual_estimate.h"

#include "base/random.h"

#include <cmath>
#include <cstdint>

#include <gtest/gtest.h>

namespace enfilade {
namespace {

constexpr double kReflectingArea = 8;  // m2
constexpr double kMeanReflected = 4;   // W/m2
constexpr ErrorScale kScale = {kMeanReflected, kReflectingArea, {}};
constexpr uint64_t kRays = 1000;

// The relative error whose square has this integral, W^2/m2.
double ErrorOf(double integral) {
  return std::sqrt(integral / kReflectingArea) / kMeanReflected;
}

// A probe that stands for the whole area, so that the mean of all probes is the
// integral.
ProbeResidual Probe(double square) {
  return {kReflectingArea, square, 0, {0.5, 0.5, 0.5}};
}

// `count` probes, half of them with each square.
ResidualSum Halves(double first, double second, int count) {
  ResidualSum sum(kScale);
  for (int i = 0; i < count; ++i) {
    sum.Add(Probe(i % 2 == 0 ? first : second));
  }
  return sum;
}

TEST(ResidualEstimate, IsTheRootOfTheMeanRelativeToTheLight) {
  const ResidualEstimate e = Halves(0.25, 0.25, 16).Estimate({}, kRays);
  EXPECT_DOUBLE_EQ(e.value, 0.5 / kMeanReflected);
  EXPECT_DOUBLE_EQ(e.low, e.value);
  EXPECT_DOUBLE_EQ(e.high, e.value);
  EXPECT_DOUBLE_EQ(e.least, e.value);
  EXPECT_DOUBLE_EQ(e.most, e.value);
  EXPECT_EQ(e.points, 16U);
  EXPECT_EQ(e.rays, kRays);
}

// The squares 1 and 4 of 16 probes are integrals of 20 +- 12 over 8 m2, so that
// their mean deviates by 3. With the deviation of 4 of what reflection adds,
// the deviation is 5.
TEST(ResidualEstimate, AddsWhatReflectionAddsAndHowUnsureItIs) {
  const ResidualEstimate e = Halves(1, 4, 16).Estimate({80, 4}, kRays);
  EXPECT_DOUBLE_EQ(e.value, ErrorOf(100));
  EXPECT_DOUBLE_EQ(e.low, ErrorOf(100 - 1.96 * 5));
  EXPECT_DOUBLE_EQ(e.high, ErrorOf(100 + 1.96 * 5));
  EXPECT_DOUBLE_EQ(e.least, e.value);
  EXPECT_DOUBLE_EQ(e.most, ErrorOf(100 + 5));
}

// Unbiased squares have either sign if there is nothing but noise.
TEST(ResidualEstimate, NoiseAloneIsNoError) {
  const ResidualEstimate e = Halves(1, -1, 64).Estimate({}, kRays);
  EXPECT_EQ(e.value, 0);
  EXPECT_EQ(e.low, 0);
  EXPECT_EQ(e.least, 0);
  EXPECT_DOUBLE_EQ(e.high, ErrorOf(1.96 * kReflectingArea / 8));
}

TEST(ResidualEstimate, WhereOnePointLeavesAllOpenTheOthersSayTheLeast) {
  ResidualSum sum = Halves(1, 1, 1024);
  sum.Add(Probe(1 << 16));
  const ResidualEstimate e = sum.Estimate({}, kRays);
  EXPECT_EQ(e.low, 0);
  EXPECT_GT(e.value, 7 * ErrorOf(kReflectingArea)) << "a mean of 65";
  EXPECT_DOUBLE_EQ(e.least, ErrorOf(kReflectingArea));
}

// Two probes far below zero are left out of the least, but not of the mean.
TEST(ResidualEstimate, OutliersBelowZeroLeaveNoLessThanTheLeast) {
  ResidualSum sum = Halves(1, 1, 10'000);
  sum.Add(Probe(-3000));
  sum.Add(Probe(-3000));
  const ResidualEstimate e = sum.Estimate({}, kRays);
  EXPECT_DOUBLE_EQ(e.least, ErrorOf(kReflectingArea));
  EXPECT_GE(e.most, e.least);
}

// Noise in what reflection adds may cancel all of the error that is seen.
TEST(ResidualEstimate, ReflectionsBelowZeroLeaveNoLessThanTheLeast) {
  const ResidualEstimate e =
      Halves(0.9, 1.1, 1'000)
          .Estimate({-0.8 * kReflectingArea, 0.4 * kReflectingArea}, kRays);
  // The least estimate leaves out one probe that is a tenth above the mean of a
  // thousand.
  EXPECT_NEAR(e.least, ErrorOf(kReflectingArea), 1e-4);
  EXPECT_GE(e.most, e.least);
}

// A mean that is below zero by chance may be as much above zero.
TEST(ResidualEstimate, AMeanBelowZeroLeavesRoomForItsDeviation) {
  const ResidualEstimate e = Halves(-1, -1, 64).Estimate({0, 3}, kRays);
  EXPECT_EQ(e.value, 0);
  EXPECT_DOUBLE_EQ(e.most, ErrorOf(3));
}

// Half of all directions see something, and half of that light is reflected: a
// bounce leaves a quarter of the light. Half of the area sees nothing and is no
// part of the mean.
TEST(ResidualEstimate, AddsWhatIsNotSeenByTheLightThatABounceLeaves) {
  const auto value_of = [](UnseenError unseen, double enclosed) {
    ResidualSum sum({kMeanReflected, kReflectingArea, unseen});
    sum.Add({kReflectingArea, 1, enclosed, {0.25, 0.5, 0.75}});
    sum.Add({kReflectingArea, 1, 0, {0.25, 0.5, 0.75}});
    return sum.Estimate({}, kRays).value;
  };
  const double seen = ErrorOf(kReflectingArea);
  EXPECT_DOUBLE_EQ(value_of({}, 0.5), seen);
  EXPECT_DOUBLE_EQ(value_of({0, 0.75}, 0.5), seen * (1 + 0.75 * 0.25));
  EXPECT_DOUBLE_EQ(value_of({0.05, 0.75}, 0), seen * 1.05);
}

// A residual of 1 under noise, by products of two independent estimates. The
// interval is 1.96 deviations: of 400 intervals 20 miss, with a deviation of
// 4.36, of which 4 are allowed to either side.
TEST(ResidualEstimate, NineteenOfTwentyIntervalsHoldTheError) {
  constexpr int kRuns = 400;
  constexpr int kPointsPerRun = 1000;
  int missed = 0;
  for (uint64_t seed = 0; seed < kRuns; ++seed) {
    Random random(seed);
    ResidualSum sum(kScale);
    for (int i = 0; i < kPointsPerRun; ++i) {
      const double first = 1 + 4 * (random.Next() - 0.5);
      const double second = 1 + 4 * (random.Next() - 0.5);
      sum.Add(Probe(first * second));
    }
    const ResidualEstimate e = sum.Estimate({}, kRays);
    const double error = ErrorOf(kReflectingArea);
    missed += error < e.low || error > e.high ? 1 : 0;
  }
  EXPECT_LE(missed, 20 + 17);
  EXPECT_GE(missed, 20 - 17);
}

ResidualEstimate Interval(double low, double high) {
  ResidualEstimate e;
  e.value = (low + high) / 2;
  e.low = low;
  e.high = high;
  e.rays = kRays;
  return e;
}

TEST(ResidualEstimate, IsDecidedClearOfTheRequestedErrorOrWhereNarrow) {
  EXPECT_FALSE(IsDecided(Interval(0.08, 0.12), 0.1, {}));
  EXPECT_TRUE(IsDecided(Interval(0.08, 0.12), 0.13, {}));
  EXPECT_TRUE(IsDecided(Interval(0.08, 0.12), 0.07, {}));
  EXPECT_TRUE(IsDecided(Interval(0.095, 0.105), 0.1, {})) << "5 % to each side";
  EXPECT_FALSE(IsDecided(Interval(0.093, 0.107), 0.1, {})) << "7 %";
}

// If few points hold all of the error, a few other points see none of it.
TEST(ResidualEstimate, BelowTheRequestedErrorItTakesRaysToBelieveIt) {
  EXPECT_FALSE(IsDecided(Interval(0.08, 0.12), 0.13, {kRays + 1, 0}));
  EXPECT_TRUE(IsDecided(Interval(0.08, 0.12), 0.13, {kRays, kRays + 1}));
}

TEST(ResidualEstimate, AboveTheRequestedErrorItTakesRaysToLocateIt) {
  EXPECT_FALSE(IsDecided(Interval(0.08, 0.12), 0.07, {0, kRays + 1}));
  EXPECT_TRUE(IsDecided(Interval(0.08, 0.12), 0.07, {kRays + 1, kRays}));
}

}  // namespace
}  // namespace enfilade
