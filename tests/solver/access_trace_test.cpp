#include "solver/access_trace.h"

#include <gtest/gtest.h>

namespace enfilade {
namespace {

// A solve whose cells are all in memory reads nothing for hours.
TEST(AccessTrace, StaysSmallHoweverOftenABlockIsHit) {
  AccessTrace trace(1000);
  const BlockKey key{BlockKind::kCellTree, 1};
  trace.Record(key, 100);
  for (int i = 0; i < 1'000'000; ++i) {
    trace.RecordHit(key);
  }
  EXPECT_LT(trace.SizeBytes(), 2U << 20);
  uint64_t belady = 0;
  uint64_t compulsory = 0;
  trace.Measure(&belady, &compulsory);
  EXPECT_EQ(belady, 100U);
  EXPECT_EQ(compulsory, 100U);
}

}  // namespace
}  // namespace enfilade
