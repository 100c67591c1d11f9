#include "base/bytes.h"
#include "base/hash.h"
#include "base/ids.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "base/photometry.h"
#include "base/random.h"
#include "base/vec.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <stdexcept>
#include <string>
#include <thread>
#include <type_traits>
#include <vector>

#include "tests/memory_peak.h"
#include <gtest/gtest.h>

namespace enfilade {
namespace {

Bytes SampleBytes() {
  ByteWriter writer;
  writer.Put(uint16_t{0x1234});
  writer.PutVarint(300);
  writer.PutString("Flur");
  writer.PutArray(std::span<const double>(std::vector<double>{1.5, -2.0}));
  return writer.Take();
}

void ReadSample(std::span<const std::byte> bytes) {
  ByteReader reader(bytes);
  EXPECT_EQ(reader.Get<uint16_t>(), 0x1234);
  EXPECT_EQ(reader.GetVarint(), 300U);
  EXPECT_EQ(reader.GetString(), "Flur");
  EXPECT_EQ(reader.GetArray<double>(), (std::vector<double>{1.5, -2.0}));
  EXPECT_TRUE(reader.AtEnd());
}

// A type with padding cannot be written: it is not packed.
struct Padded {
  uint32_t a = 0;
  uint64_t b = 0;
};

static_assert(kIsPacked<uint64_t> && kIsPacked<double> &&
              kIsPacked<std::array<float, 3>> && kIsPacked<Box3>);
static_assert(!kIsPacked<Padded> && !kIsPacked<std::array<Padded, 2>>);

TEST(Bytes, ReadersReturnWhatWasWritten) {
  ReadSample(SampleBytes());
}

TEST(Bytes, EveryTruncatedPrefixIsDamaged) {
  const Bytes bytes = SampleBytes();
  for (size_t size = 0; size < bytes.size(); ++size) {
    EXPECT_THROW(ReadSample(std::span(bytes).first(size)), DamagedStoreError)
        << size << " bytes";
  }
}

TEST(Bytes, VarintsOfAllLengthsComeBack) {
  for (int bit = 0; bit < 64; ++bit) {
    for (const uint64_t offset : {uint64_t{0}, uint64_t{1}}) {
      const uint64_t value = (uint64_t{1} << bit) - offset;
      ByteWriter writer;
      writer.PutVarint(value);
      EXPECT_LE(writer.Size(), 10U);
      EXPECT_EQ(ByteReader(writer.View()).GetVarint(), value);
    }
  }
}

TEST(Bytes, ImpossibleArrayLengthIsDamagedBeforeItIsAllocated) {
  ByteWriter writer;
  writer.PutVarint(std::numeric_limits<uint64_t>::max());
  EXPECT_THROW(ByteReader(writer.View()).GetArray<double>(), DamagedStoreError);
}

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

TEST(FreeVector, LeavesNothingAllocated) {
  std::vector<int> vector(1000);
  FreeVector(&vector);
  EXPECT_TRUE(vector.empty());
  EXPECT_EQ(vector.capacity(), 0U);
}

TEST(OnAllThreads, SharesOutAllThereIsToDo) {
  constexpr size_t kItems = 10000;
  std::vector<std::atomic<int>> done(kItems);
  std::atomic<size_t> next = 0;
  OnAllThreads([&] {
    for (size_t i = next++; i < kItems; i = next++) {
      ++done[i];
    }
  });
  for (const std::atomic<int>& times : done) {
    EXPECT_EQ(times, 1);
  }
}

// Each call waits for another one, which only another thread can make.
TEST(OnAllThreads, HasSeveralAtWorkAtOnce) {
  if (std::thread::hardware_concurrency() < 2) {
    GTEST_SKIP() << "there is one thread";
  }
  const auto give_up = std::chrono::steady_clock::now() +
                       std::chrono::seconds(20);  // on a machine that is busy
  std::atomic<int> calls = 0;
  std::atomic<bool> have_met = false;
  OnAllThreads([&] {
    ++calls;
    while (!have_met && std::chrono::steady_clock::now() < give_up) {
      have_met = calls > 1;
      std::this_thread::yield();
    }
  });
  EXPECT_TRUE(have_met);
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

Box3 RandomBox(Random* random) {
  const auto point = [&] {
    const double x = random->Next();
    const double y = random->Next();
    return Point3{x, y, random->Next()};
  };
  Box3 box;
  box.Include(point());
  box.Include(Lerp(point(), box.low, 0.5));
  return box;
}

Point3 RandomPointIn(const Box3& box, Random* random) {
  const Vec3 e = box.Extent();
  const double x = random->Next();
  const double y = random->Next();
  return box.low + Vec3{e.x * x, e.y * y, e.z * random->Next()};
}

// A box through which a segment between two boxes passes meets their hull.
TEST(MeetsHull, WhereASegmentPasses) {
  Random random(11);
  int met = 0;
  int passed = 0;
  for (int i = 0; i < 400; ++i) {
    const Box3 a = RandomBox(&random);
    const Box3 b = RandomBox(&random);
    const Box3 box = RandomBox(&random);
    bool passes = false;
    for (int k = 0; k < 20000 && !passes; ++k) {
      const Point3 p = RandomPointIn(a, &random);
      passes = box.Contains(Lerp(p, RandomPointIn(b, &random), random.Next()));
    }
    const bool meets = MeetsHull(box, a, b);
    EXPECT_TRUE(meets || !passes) << i;
    met += meets ? 1 : 0;
    passed += passes ? 1 : 0;
  }
  // Random points miss some boxes that meet the hull only at a corner.
  EXPECT_GT(passed, met / 2);
  EXPECT_GT(met, 40);
  EXPECT_LT(met, 200);
}

TEST(MeetsHull, NotBesideADiagonal) {
  const auto cube = [](double at_x, double at_y) {
    Box3 box;
    box.Include(Point3{at_x, at_y, 0});
    box.Include(Point3{at_x + 1, at_y + 1, 1});
    return box;
  };
  EXPECT_TRUE(MeetsHull(cube(2, 2), cube(0, 0), cube(4, 4)));
  EXPECT_TRUE(MeetsHull(cube(3, 2), cube(0, 0), cube(4, 4)));
  EXPECT_FALSE(MeetsHull(cube(3.1, 1), cube(0, 0), cube(4, 4)));
  EXPECT_FALSE(MeetsHull(cube(4, 0), cube(0, 0), cube(4, 4)));
}

TEST(Ids, OfDifferentThingsDoNotMix) {
  static_assert(!std::is_convertible_v<CellId, PatchId>);
  static_assert(!std::is_convertible_v<uint32_t, CellId>);
  EXPECT_LT(CellId(1U), CellId(2U));
  EXPECT_EQ(CellId(size_t{5}).Index(), 5U);
}

TEST(Ids, FirstOnesCountFromZero) {
  const std::vector<CellId> ids = {CellId(0U), CellId(1U), CellId(2U)};
  EXPECT_EQ(FirstIds<CellId>(3), ids);
  EXPECT_TRUE(FirstIds<CellId>(0).empty());
}

// The hash of the parts is that of the whole, so that digests of existing
// stores stay valid.
TEST(StreamingHash, OfPartsIsThatOfTheWhole) {
  std::vector<std::byte> bytes(1000);
  for (size_t i = 0; i < bytes.size(); ++i) {
    bytes[i] = static_cast<std::byte>(i * 7);
  }
  const std::span<const std::byte> all(bytes);
  for (const uint64_t seed : {uint64_t{0}, uint64_t{5}}) {
    for (const size_t part : {1U, 4U, 300U, 1000U}) {
      StreamingHash hash(seed);
      for (size_t i = 0; i < all.size(); i += part) {
        hash.Add(all.subspan(i, std::min(part, all.size() - i)));
      }
      EXPECT_EQ(hash.Value(), HashBytes(all, seed)) << part;
    }
  }
}

TEST(CallBeside, IsOverWhenItWasWaitedFor) {
  for (const size_t threads : {size_t{1}, size_t{3}}) {
    const ThreadLimit limit(threads);
    CallBeside beside;
    beside.Wait();  // for nothing
    for (int i = 1; i <= 100; ++i) {
      std::atomic<int> done = 0;
      beside.Start([&] { ++done; });
      // A ParallelFor of the owner neither waits for the task nor begins it.
      ParallelFor(3, [](size_t /*i*/) {});
      beside.Wait();
      EXPECT_EQ(done, 1);
    }
  }
}

TEST(CallBeside, ThrowsWhereItIsWaitedFor) {
  CallBeside beside;
  beside.Start([] { throw std::runtime_error("full"); });
  EXPECT_THROW(beside.Wait(), std::runtime_error);
  beside.Wait();
  std::atomic<int> done = 0;
  {
    CallBeside gone;
    gone.Start([&] {
      ++done;
      throw std::runtime_error("full");
    });
  }
  EXPECT_EQ(done, 1);
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
