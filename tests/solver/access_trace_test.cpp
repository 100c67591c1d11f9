#include "solver/access_trace.h"

#include <algorithm>

#include <gtest/gtest.h>

namespace enfilade {
namespace {

// Of the cache, of which the trace must be a small part.
constexpr uint64_t kCapacity = 16 << 20;

// A solve whose cells are all in memory reads nothing for hours.
TEST(AccessTrace, StaysSmallHoweverOftenABlockIsHit) {
  AccessTrace trace(kCapacity);
  const BlockKey key{BlockKind::kCellTree, 1};
  trace.Record(key, 100);
  for (int i = 0; i < 1'000'000; ++i) {
    trace.RecordHit(key);
  }
  EXPECT_LT(trace.SizeBytes(), kCapacity / 32);
  uint64_t belady = 0;
  uint64_t compulsory = 0;
  trace.Measure(&belady, &compulsory);
  EXPECT_EQ(belady, 100U);
  EXPECT_EQ(compulsory, 100U);
}

// A solve that reads ever other blocks: each is read once, whatever is kept.
TEST(AccessTrace, StaysSmallHoweverManyBlocksThereAre) {
  AccessTrace trace(kCapacity);
  constexpr uint32_t kBlocks = 300'000;
  uint64_t most = 0;
  for (uint32_t i = 0; i < kBlocks; ++i) {
    trace.Record({BlockKind::kLinks, i}, 10);
    most = std::max(most, trace.SizeBytes());
  }
  EXPECT_LT(most, kCapacity / 32);
  uint64_t belady = 0;
  uint64_t compulsory = 0;
  trace.Measure(&belady, &compulsory);
  EXPECT_EQ(belady, 10U * kBlocks);
  EXPECT_EQ(compulsory, 10U * kBlocks);
}

}  // namespace
}  // namespace enfilade
