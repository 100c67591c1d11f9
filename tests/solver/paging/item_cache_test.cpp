// What goes, what stays, and what is written back. Items say that they take
// much more than they do, so that the memory of the test itself is negligible.

#include "solver/paging/item_cache.h"

#include <cstdint>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "tests/budgets.h"
#include "tests/solver/row_of_rooms.h"
#include <gtest/gtest.h>

namespace enfilade {
namespace {

constexpr uint64_t kMiB = 1 << 20;
constexpr uint64_t kItem = 64 * kMiB;
constexpr uint64_t kStored = 1000;
// More than is evicted beyond what is asked for, but less than an item.
constexpr uint64_t kSlack = 16 * kMiB;

ItemKey ReceivedBy(uint32_t cell) {
  return {ItemKind::kReceived, cell};
}

// Refinement is at cell 1 of five: 2, 3 and 4 come next, and then 0.
class ItemsInRow : public ::testing::Test {
 protected:
  ItemsInRow() {
    order_.StartSweep(SweepKind::kRefine);
    StartTurn(1);
  }

  void StartTurn(uint32_t cell) {
    order_.StartTurn(CellId(cell), {});
    items_.StartTurn();
  }

  // Room for so many items, and no more.
  void LeaveRoomFor(uint64_t items) {
    others_.emplace(
        budget_, budget_.FreeBytes() - items * kItem - kSlack, "others");
  }

  void Insert(uint32_t cell) {
    items_.MakeRoom(kItem, "a test");
    items_.Insert(ReceivedBy(cell), std::make_shared<uint32_t>(cell), kBytes);
  }

  void InsertChanged(uint32_t cell) {
    items_.MakeRoom(kItem, "a test");
    items_.InsertChanged(
        ReceivedBy(cell), std::make_shared<uint32_t>(cell), kBytes);
  }

  std::vector<uint32_t> InMemory() {
    std::vector<uint32_t> cells;
    for (uint32_t cell = 0; cell < kCells; ++cell) {
      if (items_.Has(ReceivedBy(cell))) {
        cells.push_back(cell);
      }
    }
    return cells;
  }

  static constexpr uint32_t kCells = 5;
  static constexpr ItemCache::Bytes kBytes{kItem, kItem, kStored};

  test::RowOfRooms row_{kCells};
  MemoryBudget budget_{kRoomy};
  PairTable pairs_{*row_.store, kCells, budget_};
  NextUse order_{pairs_, budget_};
  std::vector<uint32_t> saved_;
  ItemCache items_{order_, budget_, [this](const ItemKey& key, const void*) {
                     saved_.push_back(key.cell);
                     return kStored;
                   }};
  std::optional<MemoryCharge> others_;
};

using CellNumbers = std::vector<uint32_t>;

TEST_F(ItemsInRow, WhatIsNeededLastGoesFirst) {
  LeaveRoomFor(3);
  for (const uint32_t cell : {0U, 2U, 3U}) {
    Insert(cell);
  }
  EXPECT_EQ(InMemory(), (CellNumbers{0, 2, 3}));
  items_.Reserve(kItem, "a test").Reset();
  EXPECT_EQ(InMemory(), (CellNumbers{2, 3}));
  items_.Reserve(2 * kItem, "a test").Reset();
  EXPECT_EQ(InMemory(), (CellNumbers{2}));
}

TEST_F(ItemsInRow, WhatIsInUseStays) {
  LeaveRoomFor(2);
  Insert(0);
  Insert(2);
  auto used = items_.Use<uint32_t>(ReceivedBy(0));
  items_.Reserve(kItem, "a test").Reset();
  EXPECT_EQ(InMemory(), (CellNumbers{0}));
  EXPECT_EQ(*used, 0U);
  EXPECT_THROW(items_.Reserve(2 * kItem, "a test"), DoesNotFitError);
  used.reset();
  items_.Reserve(2 * kItem, "a test").Reset();
  EXPECT_EQ(InMemory(), CellNumbers{});
}

// Memory that would not do in any case is not bought with what is needed.
TEST_F(ItemsInRow, NothingGoesForWhatFindsNoRoomAnyway) {
  LeaveRoomFor(3);
  Insert(0);
  Insert(2);
  const auto used = items_.Use<uint32_t>(ReceivedBy(2));
  EXPECT_EQ(items_.ReserveIfPossible(3 * kItem, "a test").Bytes(), 0U);
  EXPECT_EQ(InMemory(), (CellNumbers{0, 2}));
  EXPECT_EQ(items_.ReserveIfPossible(2 * kItem, "a test").Bytes(), 2 * kItem);
  EXPECT_EQ(InMemory(), (CellNumbers{2}));
}

TEST_F(ItemsInRow, WhatNeedNotBeKeptDrivesOutOnlyWhatIsNeededLater) {
  const auto keep = [&](uint32_t cell) {
    items_.InsertIfPossible(
        ReceivedBy(cell), std::make_shared<uint32_t>(cell), kBytes);
  };
  LeaveRoomFor(1);
  Insert(3);
  keep(2);
  EXPECT_EQ(InMemory(), (CellNumbers{2}));
  keep(4);
  EXPECT_EQ(InMemory(), (CellNumbers{2})) << "cell 2 comes earlier";
  keep(1);
  EXPECT_EQ(InMemory(), (CellNumbers{2}))
      << "none is sought again in this turn";
  StartTurn(1);
  keep(1);
  EXPECT_EQ(InMemory(), (CellNumbers{1}));
}

TEST_F(ItemsInRow, WhatWasChangedIsWrittenBackOnce) {
  LeaveRoomFor(3);
  Insert(0);
  InsertChanged(2);
  {
    const auto used = items_.Use<uint32_t>(ReceivedBy(0));
    items_.MarkChanged(ReceivedBy(0), kItem, "a test");
  }
  EXPECT_EQ(saved_, CellNumbers{}) << "not before it must be";
  items_.Reserve(2 * kItem, "a test").Reset();
  EXPECT_EQ(saved_, CellNumbers{0});
  items_.Flush();
  EXPECT_EQ(saved_, (CellNumbers{0, 2}));
  items_.Flush();
  items_.EvictAll();
  EXPECT_EQ(saved_, (CellNumbers{0, 2}));
}

TEST_F(ItemsInRow, WhatIsForgottenIsNotWrittenBack) {
  InsertChanged(2);
  items_.Forget(ReceivedBy(2));
  items_.Forget(ReceivedBy(3));  // it was never there
  items_.Flush();
  EXPECT_EQ(saved_, CellNumbers{});
  EXPECT_EQ(items_.Use<uint32_t>(ReceivedBy(2)), nullptr);
}

TEST_F(ItemsInRow, ItemsThatGrowAreChargedForIt) {
  const uint64_t before = budget_.UsedBytes();
  Insert(2);
  const auto used = items_.Use<uint32_t>(ReceivedBy(2));
  items_.Resize(ReceivedBy(2), 3 * kItem, "a test");
  EXPECT_EQ(budget_.UsedBytes(), before + 3 * kItem);
  EXPECT_EQ(items_.HeldBytes(ReceivedBy(2)), 3 * kItem);
  items_.MarkChanged(ReceivedBy(2), kItem, "a test");
  EXPECT_EQ(budget_.UsedBytes(), before + kItem);
}

// The reads of the best cache: an item that it had to give up is read again.
TEST_F(ItemsInRow, TellsTheTraceWhatWasUsed) {
  Insert(2);
  for (int i = 0; i < 2; ++i) {
    EXPECT_NE(items_.Use<uint32_t>(ReceivedBy(2)), nullptr);
  }
  EXPECT_EQ(items_.Trace().TakeReads().belady, kStored);
  items_.EvictAll();
  Insert(2);
  EXPECT_NE(items_.UseBriefly<uint32_t>(ReceivedBy(2)), nullptr);
  EXPECT_EQ(items_.Trace().TakeReads().belady, kStored);
}

using ItemsInRowDeath = ItemsInRow;

TEST_F(ItemsInRowDeath, AnItemIsInsertedOnce) {
  Insert(2);
  EXPECT_DEATH(Insert(2), "is in memory already");
}

}  // namespace
}  // namespace enfilade
