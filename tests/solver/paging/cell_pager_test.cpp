// What was changed comes back as it was, however often it is evicted.

#include "solver/paging/cell_pager.h"

#include "solver/elements/cell_delta.h"

#include <memory>
#include <span>
#include <vector>

#include "tests/budgets.h"
#include "tests/solver/row_of_rooms.h"
#include <gtest/gtest.h>

namespace enfilade {
namespace {

constexpr CellId kPaged(1U);
constexpr PatchId kSplitWall(2U);

std::vector<float> ValuesOf(const CoefficientArray& array) {
  std::vector<float> values;
  for (size_t page = 0; page < array.PageCount(); ++page) {
    const auto of_page = array.Page(page);
    values.insert(values.end(), of_page.begin(), of_page.end());
  }
  return values;
}

// Numbers that all differ.
void SetValues(float first, CoefficientArray* array) {
  for (size_t i = 0; i < array->Size(); ++i) {
    for (float& value : (*array)[ElementId(i)]) {
      value = first++;
    }
  }
}

class CellPagerInRow : public ::testing::Test {
 protected:
  CellPagerInRow() {
    pager_.Order().StartSweep(SweepKind::kPropagate);
    pager_.StartTurn(kPaged, LoadVisibleSet(*row_.store, kPaged));
  }

  // Splits the element of the wall at the end of `path`.
  void GrowTree(ElementPath path) {
    const auto geometry = pager_.Geometry(kPaged);
    const auto tree = pager_.Tree(kPaged);
    tree->FindOrCreate(kSplitWall, ChildPath(path, 0), geometry->patches);
    pager_.MarkDirty(kPaged);
  }

  void SetReceived() {
    const auto received = pager_.Received(kPaged);
    SetValues(1, &received->gathered);
    SetValues(1000, &received->gain);
    pager_.MarkReceivedDirty(kPaged);
  }

  void SetDelta() {
    const size_t elements = pager_.Tree(kPaged)->Size();
    const auto delta = pager_.Delta(kPaged);
    delta->GrowTo(elements);
    SetValues(1, delta.get());
    pager_.MarkDeltaDirty(kPaged);
  }

  const Basis basis_{2};
  const TreeShape shape_{&basis_, kRgbChannels};
  test::RowOfRooms row_{3};
  MemoryBudget budget_{kRoomy};
  const OcclusionDevice device_{budget_, Point3{}};
  CellPager pager_{
      *row_.store, row_.scene, row_.partition, shape_, device_, budget_};
};

TEST_F(CellPagerInRow, ChangedTreesComeBackAsTheyWere) {
  GrowTree(ChildPath(kRootPath, 3));
  std::vector<float> sent;
  size_t elements = 0;
  {
    const auto tree = pager_.Tree(kPaged);
    elements = tree->Size();
    SetValues(5, &tree->Sent());
    sent = ValuesOf(tree->Sent());
    pager_.MarkDirty(kPaged);
  }
  ASSERT_EQ(elements, 6 + 2 * kChildren);
  EXPECT_EQ(CellTree::StoredSize(*row_.store, kPaged), 0U);
  pager_.Items().EvictAll();
  EXPECT_EQ(CellTree::StoredSize(*row_.store, kPaged), elements);
  const auto tree = pager_.Tree(kPaged);
  EXPECT_EQ(tree->Size(), elements);
  EXPECT_EQ(ValuesOf(tree->Sent()), sent);
}

// What is needed is made room for at the cost of what is not in use, and of
// nothing else.
TEST_F(CellPagerInRow, WantOfRoomWritesBackWhatIsNotInUse) {
  GrowTree(kRootPath);
  SetReceived();
  SetDelta();
  const auto received = pager_.Received(kPaged);
  const std::weak_ptr<CellTree> tree = pager_.Tree(kPaged);
  EXPECT_TRUE(tree.expired());
  pager_.Items().Reserve(budget_.FreeBytes() + 1, "a test").Reset();
  EXPECT_EQ(CellTree::StoredSize(*row_.store, kPaged), 6 + kChildren);
  EXPECT_GT(row_.store->Count(BlockKind::kCellDelta), 0U);
  EXPECT_EQ(row_.store->Count(BlockKind::kReceived), 0U) << "it is in use";
  EXPECT_EQ(pager_.Received(kPaged), received);
}

// A tree that grew as the source of another cell has elements that have
// received nothing; the budget is charged for them.
TEST_F(CellPagerInRow, ReceivedLightGrowsWithItsTree) {
  for (const bool is_evicted : {false, true}) {
    SetReceived();
    const auto before = ValuesOf(pager_.Received(kPaged)->gathered);
    const auto gain = ValuesOf(pager_.Received(kPaged)->gain);
    const uint64_t charged =
        is_evicted ? 0 : pager_.Received(kPaged)->SizeBytes();
    GrowTree(is_evicted ? ChildPath(kRootPath, 1) : kRootPath);
    if (is_evicted) {
      pager_.Items().EvictAll();
    }
    const size_t elements = pager_.Tree(kPaged)->Size();
    const uint64_t used = budget_.UsedBytes();
    const auto received = pager_.Received(kPaged);
    EXPECT_GE(received->SizeBytes(), ReceivedLight::BytesFor(elements, shape_));
    EXPECT_EQ(budget_.UsedBytes() - used, received->SizeBytes() - charged)
        << "evicted: " << is_evicted;
    auto expected = before;
    expected.resize(elements * shape_.Stride());
    EXPECT_EQ(ValuesOf(received->gathered), expected);
    expected = gain;
    expected.resize(elements * shape_.NodeStride());
    EXPECT_EQ(ValuesOf(received->gain), expected);
  }
}

// A new element has sent what its parent had sent there, also to those who read
// the delta from the store.
TEST_F(CellPagerInRow, DeltasGrowWithTheirTrees) {
  for (const bool is_evicted : {false, true}) {
    SetDelta();
    const auto before = ValuesOf(*pager_.Delta(kPaged));
    const ElementPath path = is_evicted ? ChildPath(kRootPath, 1) : kRootPath;
    GrowTree(path);
    if (is_evicted) {
      pager_.Items().EvictAll();
    }
    std::vector<float> grown;
    {
      const auto geometry = pager_.Geometry(kPaged);
      const auto tree = pager_.Tree(kPaged);
      const auto delta = pager_.Delta(kPaged);
      ASSERT_EQ(delta->Size(), tree->Size());
      grown = ValuesOf(*delta);
      EXPECT_TRUE(std::equal(before.begin(), before.end(), grown.begin()));
      const ElementId parent =
          tree->FindOrCreate(kSplitWall, path, geometry->patches);
      std::vector<float> restricted(shape_.Stride());
      for (size_t c = 0; c < kChildren; ++c) {
        PushTo(basis_.parallelogram, shape_, c, (*delta)[parent], restricted);
        const auto child =
            (*delta)[ElementId(tree->At(parent).first_child + c)];
        EXPECT_TRUE(std::equal(child.begin(), child.end(), restricted.begin()));
      }
    }
    pager_.Items().EvictAll();
    const CoefficientArray stored =
        LoadDelta(*row_.store, kPaged, shape_, grown.size() / shape_.Stride());
    EXPECT_EQ(ValuesOf(stored), grown);
  }
}

TEST_F(CellPagerInRow, WhatIsForgottenIsNeitherInMemoryNorInTheStore) {
  SetDelta();
  pager_.Items().Flush();
  SetDelta();
  pager_.ForgetDelta(kPaged);
  EXPECT_EQ(row_.store->Count(BlockKind::kCellDelta), 0U);
  pager_.Items().Flush();
  EXPECT_EQ(row_.store->Count(BlockKind::kCellDelta), 0U);
  EXPECT_EQ(pager_.Delta(kPaged)->Size(), 0U);
}

// Whoever holds it would write to what nobody reads.
TEST_F(CellPagerInRow, WhatIsInUseIsNotForgotten) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  SetDelta();
  const auto delta = pager_.Delta(kPaged);
  EXPECT_DEATH(pager_.ForgetDelta(kPaged), "what is forgotten is in use");
}

TEST_F(CellPagerInRow, WhatIsNotInUseIsNotChanged) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  SetDelta();
  EXPECT_DEATH(pager_.MarkDeltaDirty(kPaged), "what is changed is not in use");
}

}  // namespace
}  // namespace enfilade
