#include "base/memory.h"

#include "base/error.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "tests/memory_peak.h"
#include <gtest/gtest.h>

namespace enfilade {
namespace {

TEST(FreeVector, LeavesNothingAllocated) {
  std::vector<int> vector(1000);
  FreeVector(&vector);
  EXPECT_TRUE(vector.empty());
  EXPECT_EQ(vector.capacity(), 0U);
}

// The tests of memory that ran before in this process take no part in it.
TEST(PeakResident, BeginsAnewWhenItIsReset) {
#ifndef ENFILADE_JEMALLOC
  GTEST_SKIP() << "sanitizers keep what is freed";
#endif
  if (!ResetPeak()) {
    GTEST_SKIP() << "the kernel does not reset the peak";
  }
  constexpr uint64_t kBytes = 64 << 20;
  const uint64_t before = BeginPeak();
  std::vector<char> ballast(kBytes, 1);
  EXPECT_GE(PeakResidentBytes(), before + kBytes / 2);
  FreeVector(&ballast);
  EXPECT_LT(BeginPeak(), before + kBytes / 2);
}

// Memory that each thread takes beside what is charged comes off the budget.
TEST(MemoryBudget, MoreThreadsLeaveLess) {
  constexpr uint64_t kCap = 64 << 20;
  const uint64_t of_two = MemoryBudget::BudgetUnderCap(kCap);
  MemoryBudget::SetThreads(1);
  EXPECT_EQ(MemoryBudget::BudgetUnderCap(kCap), of_two);
  MemoryBudget::SetThreads(16);
  const uint64_t of_sixteen = MemoryBudget::BudgetUnderCap(kCap);
  EXPECT_LT(of_sixteen, of_two - (4 << 20));
  EXPECT_EQ(MemoryBudget::CapForBudget(of_sixteen - (1 << 19)), kCap);
  MemoryBudget::SetThreads(2);
}

// The cap is a few MiB above what the process takes now, so that freed memory
// which the allocator still holds uses up the budget.
TEST(MemoryBudget, NearTheCapWhatWasFreedIsGivenBack) {
#ifndef ENFILADE_JEMALLOC
  GTEST_SKIP() << "sanitizers keep what is freed";
#endif
  constexpr uint64_t kMiB = 1 << 20;
  constexpr uint64_t kBytes = 64 * kMiB;
  const uint64_t before = ResidentBytes();
  const uint64_t fixed = MemoryBudget::CapForBudget(8 * kMiB) - 8 * kMiB;
  MemoryBudget budget(std::max(before, fixed) + 32 * kMiB - fixed);
  std::vector<std::vector<char>> blocks;
  for (uint64_t i = 0; i < kBytes / kMiB; ++i) {
    blocks.emplace_back(kMiB, 'x');
  }
  FreeVector(&blocks);
  EXPECT_GT(ResidentBytes(), before + kBytes / 2) << "it is kept";
  budget.Charge(kMiB / 2, "less than is worth a look");
  EXPECT_GT(ResidentBytes(), before + kBytes / 2);
  budget.Charge(kMiB, "more");
  EXPECT_LT(ResidentBytes(), before + kBytes / 4);
}

// What is freed lies together and serves smaller arrays too: a cell that is
// loaded again and again takes its place once.
TEST(FreedMemory, ServesSmallerArrays) {
#ifndef ENFILADE_JEMALLOC
  GTEST_SKIP() << "sanitizers keep what is freed";
#endif
  constexpr uint64_t kBytes = 64 << 20;
  const auto fill = [](uint64_t size) {
    std::vector<std::vector<char>> arrays;
    for (uint64_t i = 0; i < kBytes / size; ++i) {
      arrays.emplace_back(size, 'x');
    }
    return arrays;
  };
  ReleaseFreedMemory();
  const uint64_t before = ResidentBytes();
  for (const uint64_t size : {192U << 10, 96U << 10, 48U << 10, 20U << 10}) {
    EXPECT_EQ(fill(size).back().back(), 'x');
    EXPECT_LT(ResidentBytes(), before + kBytes + kBytes / 4) << size;
  }
  ReleaseFreedMemory();
  EXPECT_LT(ResidentBytes(), before + kBytes / 4);
}

TEST(ResidentBytes, FallWhenCodeIsReleasedWhichComesAgain) {
  // The code of this program and of its libraries takes some MiB.
  constexpr uint64_t kLeast = 256 << 10;
  EXPECT_EQ(std::to_string(1.5), "1.500000");
  const uint64_t before = ResidentBytes();
  ReleaseCode();
  EXPECT_LT(ResidentBytes(), before - kLeast);
  EXPECT_EQ(std::to_string(1.5), "1.500000");
}

TEST(MemoryBudget, ChargesUpToItsLimitAndNotBeyond) {
  MemoryBudget budget(100);
  EXPECT_TRUE(budget.TryCharge(100));
  EXPECT_FALSE(budget.TryCharge(1));
  EXPECT_FALSE(budget.TryCharge(std::numeric_limits<uint64_t>::max()));
  EXPECT_EQ(budget.FreeBytes(), 0U);
  budget.Release(60);
  EXPECT_EQ(budget.UsedBytes(), 40U);
  EXPECT_EQ(budget.PeakBytes(), 100U);
}

TEST(MemoryBudget, RefusalNamesWhatAndACap) {
  MemoryBudget budget(10);
  try {
    budget.Charge(11, "the test");
    FAIL() << "charged more than the limit";
  } catch (const DoesNotFitError& error) {
    const std::string what = error.what();
    EXPECT_NE(what.find("the test"), std::string::npos);
    EXPECT_NE(what.find("--memory"), std::string::npos);
  }
  EXPECT_EQ(budget.UsedBytes(), 0U);
}

// If a budget is a part of the process's budget, its refusal names a cap for
// the whole process.
TEST(MemoryBudget, RefusalOfAPartNamesACapForTheWhole) {
  constexpr uint64_t kCap = 100ULL << 20;
  constexpr double kShare = 0.25;
  const uint64_t whole = MemoryBudget::BudgetUnderCap(kCap);
  MemoryBudget part(static_cast<uint64_t>(kShare * static_cast<double>(whole)),
                    kShare);
  try {
    part.Charge(part.LimitBytes() + 1, "the test");
    FAIL() << "charged more than the limit";
  } catch (const DoesNotFitError& error) {
    const std::string what = error.what();
    const size_t at = what.find("--memory ");
    ASSERT_NE(at, std::string::npos);
    EXPECT_GT(std::stoull(what.substr(at + 9)), kCap >> 20) << what;
  }
}

// The cap that a refusal names is enough, and a megabyte less is not.
TEST(MemoryBudget, TheLeastCapForABudgetLeavesIt) {
  for (const uint64_t budget : {20'000'000ULL, 123'456'789ULL, 7ULL << 30}) {
    const uint64_t cap = MemoryBudget::CapForBudget(budget);
    EXPECT_GE(MemoryBudget::BudgetUnderCap(cap), budget);
    EXPECT_LT(MemoryBudget::BudgetUnderCap(cap - (1 << 20)), budget);
  }
}

// Near the cap is near that of the whole process, whoever asks.
TEST(MemoryBudget, AShareMeasuresTheProcessByTheWholeCap) {
  const MemoryBudget whole(1ULL << 30);
  const MemoryBudget share(64ULL << 20, 1.0 / 16);
  constexpr uint64_t kComing = 2ULL << 30;
  constexpr double kBetweenTwoLooks = 1 << 20;
  EXPECT_GT(whole.ResidentExcess(kComing), 1ULL << 29);
  EXPECT_NEAR(static_cast<double>(share.ResidentExcess(kComing)),
              static_cast<double>(whole.ResidentExcess(kComing)),
              kBetweenTwoLooks);
  EXPECT_EQ(share.ResidentExcess(128ULL << 20),
            whole.ResidentExcess(128ULL << 20));
}

TEST(MemoryBudget, ARefusalNamesACapForWhatIsForeseen) {
  const auto named = [](double share) {
    MemoryBudget budget(10 << 20);
    GrowingCharge charge(budget, "the test");
    charge.GrowTo(8 << 20);
    try {
      charge.GrowTo(20 << 20, share);
    } catch (const DoesNotFitError& error) {
      const std::string what = error.what();
      return std::stoull(what.substr(what.find("--memory ") + 9)) << 20;
    }
    return 0ULL;
  };
  EXPECT_GE(named(0.25), MemoryBudget::CapForBudget(80 << 20));
  EXPECT_LT(named(1), MemoryBudget::CapForBudget(30 << 20));
  EXPECT_EQ(named(1e-9), named(1)) << "as good as nothing was seen";
}

TEST(MemoryBudget, ChargeEndsWithItsLastOwner) {
  MemoryBudget budget(100);
  MemoryCharge outer;
  {
    MemoryCharge inner(budget, 70, "inner");
    outer = std::move(inner);
  }
  EXPECT_EQ(budget.UsedBytes(), 70U);
  outer.Reset();
  EXPECT_EQ(budget.UsedBytes(), 0U);
}

TEST(MemoryCharge, IsNothingWhereItDoesNotFit) {
  MemoryBudget budget(100);
  {
    const auto first = MemoryCharge::IfItFits(budget, 60);
    ASSERT_TRUE(first.has_value());
    EXPECT_EQ(budget.UsedBytes(), 60U);
    EXPECT_FALSE(MemoryCharge::IfItFits(budget, 41).has_value());
    EXPECT_EQ(budget.UsedBytes(), 60U);
  }
  EXPECT_EQ(budget.UsedBytes(), 0U);
}

}  // namespace
}  // namespace enfilade
