#include "base/bytes.h"
#include "base/ids.h"
#include "base/memory.h"
#include "base/random.h"

#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <type_traits>
#include <vector>

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
  // Five standard deviations: of U they are 1/sqrt(12), of U^2 sqrt(4/45).
  EXPECT_NEAR(sum / kCount, 0.5, 5 * std::sqrt(1 / 12.0 / kCount));
  EXPECT_NEAR(squares / kCount, 1 / 3.0, 5 * std::sqrt(4 / 45.0 / kCount));
}

TEST(Random, NeighbouringKeysAreUncorrelated) {
  constexpr int kCount = 100'000;
  double sum = 0;
  for (uint64_t key = 0; key < kCount; ++key) {
    sum += (Random(key).Next() - 0.5) * (Random(key + 1).Next() - 0.5);
  }
  // A product of two has standard deviation 1/12.
  EXPECT_NEAR(sum / kCount, 0, 5 / 12.0 / std::sqrt(kCount));
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

TEST(Ids, OfDifferentThingsDoNotMix) {
  static_assert(!std::is_convertible_v<CellId, PatchId>);
  static_assert(!std::is_convertible_v<uint32_t, CellId>);
  EXPECT_LT(CellId(1U), CellId(2U));
  EXPECT_EQ(CellId(size_t{5}).Index(), 5U);
}

}  // namespace
}  // namespace enfilade
