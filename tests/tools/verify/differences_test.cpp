#include "tools/verify/differences.h"

#include "base/random.h"

#include <algorithm>
#include <functional>

#include <gtest/gtest.h>

namespace enfilade {
namespace {

constexpr size_t kKept = 16;

TEST(LargestDifferencesTest, AreTheLargestInOrder) {
  LargestDifferences largest;
  Random random(5);
  std::vector<double> parts;
  double sum = 0;
  for (int i = 0; i < 1000; ++i) {
    const double part = random.Next() - 0.4;
    parts.push_back(part);
    sum += part;
    if (largest.Wants(part)) {
      DifferingPoint point;
      point.share = part;
      largest.Add(point);
    }
  }
  std::sort(parts.begin(), parts.end(), std::greater<>());
  const std::vector<DifferingPoint> kept = largest.SharesOf(sum);
  ASSERT_EQ(kept.size(), kKept);
  for (size_t i = 0; i < kKept; ++i) {
    EXPECT_DOUBLE_EQ(kept[i].share, parts[i] / sum);
  }
}

// Noise can make the sum of the parts negative, and the error 0: no point has a
// share of it.
TEST(LargestDifferencesTest, AreNoneWhereTheErrorIsZero) {
  LargestDifferences largest;
  DifferingPoint point;
  point.share = 0.5;
  largest.Add(point);
  EXPECT_EQ(largest.SharesOf(1).size(), 1U);
  EXPECT_TRUE(largest.SharesOf(0).empty());
  EXPECT_TRUE(largest.SharesOf(-0.1).empty());
}

TEST(LargestDifferencesTest, AreOnlyThoseThatAddToTheError) {
  const LargestDifferences largest;
  EXPECT_FALSE(largest.Wants(-1));
  EXPECT_FALSE(largest.Wants(0));
  EXPECT_TRUE(largest.Wants(1e-9));
}

}  // namespace
}  // namespace enfilade
