#include "base/paged_vector.h"

#include <cstdint>

#include <gtest/gtest.h>

namespace enfilade {
namespace {

using Paged = PagedVector<uint32_t>;

TEST(PagedVector, HoldsWhatWasAppended) {
  Paged v;
  constexpr uint32_t kItems = 3 * Paged::kPageItems + 7;
  for (uint32_t i = 0; i < kItems; ++i) {
    v.PushBack(i * i);
  }
  ASSERT_EQ(v.Size(), kItems);
  for (uint32_t i = 0; i < kItems; ++i) {
    ASSERT_EQ(v[i], i * i);
  }
  v.GrowTo(kItems + 10);
  EXPECT_EQ(v.Size(), kItems + 10);
  EXPECT_EQ(v[kItems + 9], 0U);
  v.GrowTo(5);  // never shrinks
  EXPECT_EQ(v.Size(), kItems + 10);
}

// Full pages never move, and at most one page is partly empty.
TEST(PagedVector, NeitherMovesNorDoublesWhatIsThere) {
  Paged v;
  v.GrowTo(2 * Paged::kPageItems);
  const uint32_t* first = &v[0];
  const uint64_t before = v.SizeBytes();
  v.PushBack(1);
  EXPECT_EQ(&v[0], first);
  v.GrowTo(100 * Paged::kPageItems);
  EXPECT_EQ(&v[0], first);
  EXPECT_LT(before, 1.01 * 2 * Paged::kPageItems * sizeof(uint32_t));
  EXPECT_LT(static_cast<double>(v.SizeBytes()),
            1.01 * 100 * Paged::kPageItems * sizeof(uint32_t));
}

// A cell of few patches has a small tree, which must not take a whole page.
TEST(PagedVector, IsSmallWhereItHoldsLittle) {
  Paged v;
  v.GrowTo(9);
  EXPECT_LT(v.SizeBytes(), 200U);
}

}  // namespace
}  // namespace enfilade
