#include "base/random.h"

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <gtest/gtest.h>

namespace enfilade {
namespace {

TEST(Random, StreamIsAFunctionOfItsKey) {
  Random first(7);
  Random second(7);
  Random other(8);
  int equal_to_other = 0;
  for (int i = 0; i < 100; ++i) {
    const uint64_t bits = first.NextBits();
    EXPECT_EQ(bits, second.NextBits());
    equal_to_other += bits == other.NextBits() ? 1 : 0;
  }
  EXPECT_EQ(equal_to_other, 0);
}

// Mixed counters of short streams come from a table; the values stay those of
// key and counter.
TEST(Random, ValuesAreThoseOfKeyAndCounter) {
  Random random(9);
  for (uint64_t counter = 0; counter < 600; ++counter) {
    EXPECT_EQ(random.NextBits(), MixKey(9, counter));
  }
}

TEST(Random, MeanAndVarianceAreThoseOfTheUnitInterval) {
  Random random(1);
  constexpr int kCount = 100'000;
  double sum = 0;
  double squares = 0;
  for (int i = 0; i < kCount; ++i) {
    const double value = random.Next();
    ASSERT_TRUE(value >= 0 && value < 1);
    sum += value;
    squares += value * value;
  }
  // Five standard errors; the standard deviation is 1/sqrt(12) for U and
  // sqrt(4/45) for U^2.
  EXPECT_NEAR(sum / kCount, 0.5, 5 * std::sqrt(1 / 12.0 / kCount));
  EXPECT_NEAR(squares / kCount, 1 / 3.0, 5 * std::sqrt(4 / 45.0 / kCount));
}

TEST(Random, NeighbouringKeysAreUncorrelated) {
  constexpr int kCount = 100'000;
  double sum = 0;
  for (uint64_t key = 0; key < kCount; ++key) {
    sum += (Random(key).Next() - 0.5) * (Random(key + 1).Next() - 0.5);
  }
  // The product of two centred values has standard deviation 1/12.
  EXPECT_NEAR(sum / kCount, 0, 5 / 12.0 / std::sqrt(kCount));
}

TEST(Random, TwoOfOneDrawAreUniformAndUncorrelated) {
  Random random(3);
  constexpr int kCount = 100'000;
  std::array<double, 2> sums{};
  std::array<double, 2> squares{};
  double products = 0;
  for (int i = 0; i < kCount; ++i) {
    const std::array<float, 2> two = random.NextTwo();
    for (size_t k = 0; k < 2; ++k) {
      const double value = two[k];
      ASSERT_TRUE(value >= 0 && value < 1);
      sums[k] += value;
      squares[k] += value * value;
    }
    products += (two[0] - 0.5) * (two[1] - 0.5);
  }
  for (size_t k = 0; k < 2; ++k) {
    EXPECT_NEAR(sums[k] / kCount, 0.5, 5 * std::sqrt(1 / 12.0 / kCount));
    EXPECT_NEAR(squares[k] / kCount, 1 / 3.0, 5 * std::sqrt(4 / 45.0 / kCount));
  }
  EXPECT_NEAR(products / kCount, 0, 5 / 12.0 / std::sqrt(kCount));
}

TEST(Random, NextBelowFillsItsRangeEvenly) {
  Random random(2);
  std::vector<int> counts(7);
  for (int i = 0; i < 70'000; ++i) {
    ++counts.at(random.NextBelow(7));
  }
  for (const int count : counts) {
    EXPECT_NEAR(count, 10'000, 5 * std::sqrt(10'000 * 6 / 7.0));
  }
}

}  // namespace
}  // namespace enfilade
