// Means that a single outlier can hide.

#include "solver/residual/outlier_sum.h"

#include "base/random.h"

#include <cmath>

#include <gtest/gtest.h>

namespace enfilade {
namespace {

TEST(OutlierSum, IsTheMeanOfAllAndOfAllButTheLargest) {
  OutlierSum sum;
  for (const double x : {1.0, -50.0, 3.0, 100.0, 2.0, 20.0, 2.0}) {
    sum.Add(x);
  }
  EXPECT_EQ(sum.Count(), 7U);
  EXPECT_DOUBLE_EQ(sum.MeanWithout(0).value, 78.0 / 7);
  EXPECT_DOUBLE_EQ(sum.MeanWithout(1).value, -22.0 / 6);
  EXPECT_DOUBLE_EQ(sum.MeanWithout(3).value, 2);
  EXPECT_DOUBLE_EQ(sum.MeanWithout(3).deviation, std::sqrt(0.5 / 4));
}

TEST(OutlierSum, OfNothingIsNothing) {
  OutlierSum sum;
  EXPECT_EQ(sum.MeanWithout(0).value, 0);
  sum.Add(5);
  EXPECT_EQ(sum.MeanWithout(1).value, 0);
  EXPECT_EQ(sum.MeanWithout(0).deviation, 0);
}

// One number in ten thousand makes the mean of all numbers uncertain; the mean
// of the others is known to a percent.
TEST(OutlierSum, KnowsTheOthers) {
  OutlierSum sum;
  Random random(5);
  for (int i = 0; i < 10000; ++i) {
    sum.Add(i == 5000 ? 1e6 : 2 * random.Next());
  }
  const SampledMean all = sum.MeanWithout(0);
  EXPECT_LT(all.value, 1.96 * all.deviation);
  const SampledMean others = sum.MeanWithout(1);
  EXPECT_NEAR(others.value, 1, 4 * others.deviation);
  EXPECT_LT(others.deviation, 0.01);
}

}  // namespace
}  // namespace enfilade
