#include "solver/refine/rare_draws.h"

#include <array>
#include <cmath>

#include <gtest/gtest.h>

namespace enfilade {
namespace {

// Each trial succeeds as often as it should, whatever came before it.
TEST(RareDraws, SucceedWithTheirProbability) {
  constexpr size_t kTrials = 40;
  constexpr int kRuns = 20000;
  for (const double probability : {0.003, 0.1, 0.49}) {
    std::array<int, kTrials> successes{};
    std::array<int, kTrials> twice_running{};
    for (uint64_t run = 0; run < kRuns; ++run) {
      size_t last = kTrials;
      for (RareDraws draws(run, probability, kTrials); !draws.AtEnd();
           draws.Next()) {
        ASSERT_LT(draws.Trial(), kTrials);
        ++successes.at(draws.Trial());
        twice_running.at(draws.Trial()) += last + 1 == draws.Trial() ? 1 : 0;
        last = draws.Trial();
      }
    }
    // Five standard deviations of a binomial number; 5 more for expected
    // numbers near zero.
    const auto near = [&](double p) { return 5 * std::sqrt(kRuns * p) + 5; };
    for (size_t i = 0; i < kTrials; ++i) {
      EXPECT_NEAR(successes.at(i), kRuns * probability, near(probability));
      const double both = i > 0 ? probability * probability : 0;
      EXPECT_NEAR(twice_running.at(i), kRuns * both, i > 0 ? near(both) : 0);
    }
  }
}

TEST(RareDraws, OfNoTrialsAreNone) {
  EXPECT_TRUE(RareDraws(1, 0.5, 0).AtEnd());
}

// The draws do not go through each of as many trials as a building has pairs.
TEST(RareDraws, GoFarInOneJump) {
  constexpr uint64_t kTrials = uint64_t{1} << 50;
  RareDraws draws(7, 0x1p-49, kTrials);
  int successes = 0;
  for (; !draws.AtEnd(); draws.Next()) {
    ++successes;
  }
  EXPECT_LE(successes, 20);  // 2 are to be expected
}

}  // namespace
}  // namespace enfilade
