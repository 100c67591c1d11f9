// Lists of fragments keep their order, in memory or in the store, and release
// the memory and blocks that they took.

#include "partition/wall_fragments.h"

#include "store/sqlite_store.h"

#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace enfilade {
namespace {

constexpr uint32_t kCount = 5000;  // some chunks

WallFragment Fragment(uint32_t i) {
  const double x = i;
  const Polygon polygon =
      i % 3 == 0 ? Polygon{{x, 0, 0}, {x, 1, 0}, {x, 1, 1}}
                 : Polygon{{x, 0, 0}, {x, 1, 0}, {x, 0, 2}, {x, 0, 1}};
  return {polygon, {{1, 0, 0}, x}, i};
}

void ExpectFragment(const WallFragment& fragment, uint32_t i) {
  const WallFragment expected = Fragment(i);
  ASSERT_EQ(fragment.plane_group, i);
  ASSERT_EQ(fragment.polygon, expected.polygon);
  ASSERT_EQ(fragment.plane.normal, expected.plane.normal);
  ASSERT_EQ(fragment.plane.offset, expected.plane.offset);
}

class FragmentLists : public ::testing::TestWithParam<uint64_t> {
 protected:
  FragmentLists()
      : store_(CreateStoreInMemory()),
        budget_(GetParam()),
        shelf_(*store_, budget_, "walls") {}

  FragmentList Filled() {
    FragmentList list(shelf_);
    for (uint32_t i = 0; i < kCount; ++i) {
      list.Add(Fragment(i));
    }
    return list;
  }

  std::unique_ptr<BlockStorage> store_;
  MemoryBudget budget_;
  ScratchShelf shelf_;
};

TEST_P(FragmentLists, AreVisitedInTheirOrderAsOftenAsAsked) {
  const FragmentList list = Filled();
  EXPECT_EQ(list.Size(), kCount);
  for (int times = 0; times < 2; ++times) {
    uint32_t next = 0;
    list.Visit([&next](const WallFragment& f) { ExpectFragment(f, next++); });
    EXPECT_EQ(next, kCount);
  }
}

TEST_P(FragmentLists, WhatIsConsumedIsGivenBackOnTheWay) {
  FragmentList list = Filled();
  EXPECT_GT(budget_.UsedBytes(), 0U);
  uint32_t next = 0;
  uint64_t used_at_end = 0;
  list.Consume([&](const WallFragment& f) {
    ExpectFragment(f, next++);
    used_at_end = budget_.UsedBytes();
  });
  EXPECT_EQ(next, kCount);
  EXPECT_LE(used_at_end, uint64_t{1} << 16);  // its end, a chunk at most
  EXPECT_EQ(budget_.UsedBytes(), 0U);
  EXPECT_EQ(store_->Count(BlockKind::kScratch), 0U);
  EXPECT_EQ(list.Size(), 0U);
}

TEST_P(FragmentLists, AMovedOneIsChargedOnce) {
  FragmentList list = Filled();
  const uint64_t used = budget_.UsedBytes();
  {
    const FragmentList other = std::move(list);
    EXPECT_EQ(other.Size(), kCount);
    EXPECT_EQ(budget_.UsedBytes(), used);
  }
  EXPECT_EQ(budget_.UsedBytes(), 0U);
}

TEST_P(FragmentLists, TwoAtOnceDoNotMix) {
  FragmentList even(shelf_);
  FragmentList odd(shelf_);
  for (uint32_t i = 0; i < kCount; ++i) {
    (i % 2 == 0 ? even : odd).Add(Fragment(i));
  }
  uint32_t next = 1;
  odd.Visit([&next](const WallFragment& f) {
    ExpectFragment(f, next);
    next += 2;
  });
  next = 0;
  even.Consume([&next](const WallFragment& f) {
    ExpectFragment(f, next);
    next += 2;
  });
  EXPECT_EQ(next, kCount);
}

INSTANTIATE_TEST_SUITE_P(Budgets,
                         FragmentLists,
                         // These budgets hold all, some chunks, or the ends of
                         // two lists.
                         ::testing::Values(uint64_t{1} << 30,
                                           uint64_t{1} << 20,
                                           uint64_t{150} << 10));

TEST(FragmentLists, BeyondTheirShareTheyWaitInTheStore) {
  const auto store = CreateStoreInMemory();
  MemoryBudget budget(uint64_t{1} << 20);
  ScratchShelf shelf(*store, budget, "walls");
  {
    FragmentList list(shelf);
    for (uint32_t i = 0; i < kCount; ++i) {
      list.Add(Fragment(i));
    }
    EXPECT_GT(store->Count(BlockKind::kScratch), 0U);
    EXPECT_LE(budget.PeakBytes(), (uint64_t{1} << 18) + (uint64_t{2} << 16));
  }
  shelf.Clear();
  EXPECT_EQ(store->Count(BlockKind::kScratch), 0U);
}

}  // namespace
}  // namespace enfilade
