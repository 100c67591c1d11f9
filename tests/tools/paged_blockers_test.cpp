// Cells that are paged in one after the other block the same segments as all of
// them together.

#include "solver/paging/paged_blockers.h"

#include "base/random.h"
#include "partition/partition.h"
#include "scene/import.h"
#include "solver/paging/cells_between.h"
#include "solver/solution/solution.h"
#include "solver/transfer/transfer_sample.h"
#include "store/sqlite_store.h"
#include "visibility/visible_set.h"

#include <algorithm>
#include <bit>
#include <memory>
#include <vector>

#include "tests/budgets.h"
#include "tests/tools/run_program.h"
#include "tools/scenes/floorplan.h"
#include <gtest/gtest.h>

namespace enfilade {
namespace {

class PagedFloor : public ::testing::Test {
 protected:
  PagedFloor() : store_(CreateStoreInMemory()) {
    ObjWriter writer(dir_ / "floor.obj");
    WriteFloorplan({12, 1, 1, 1}, writer);
    writer.Finish();
    MemoryBudget budget(kRoomy);
    ImportScene(dir_ / "floor.obj", {}, budget, *store_);
    scene_ = LoadSceneInfo(*store_);
    partition_ = BuildPartition(*store_, {}, budget);
    BuildVisibleSets(partition_, {}, budget, *store_);
  }

  // A pager of its own budget.
  struct Pages {
    Pages(PagedFloor& floor, uint64_t budget_bytes)
        : budget(budget_bytes),
          device(budget, floor.scene_.bounds.Center()),
          pager(*floor.store_,
                floor.scene_,
                floor.partition_,
                {&basis, kRgbChannels},
                device,
                budget) {}

    Basis basis = Basis(1);
    MemoryBudget budget;
    OcclusionDevice device;
    CellPager pager;
  };

  // The pair of cells with most between them.
  void FindWidestPair(CellId* receiver, VisibleCell* source) const {
    for (size_t i = 0; i < partition_.cells.size(); ++i) {
      for (VisibleCell& v : LoadVisibleSet(*store_, CellId(i))) {
        if (v.between.size() > source->between.size()) {
          *receiver = CellId(i);
          *source = std::move(v);
        }
      }
    }
  }

  // Packets of segments anywhere in the floor, in the pager's coordinates.
  SegmentPacket DrawPacket(Random* random) const {
    const Vec3 extent = scene_.bounds.Extent();
    const auto draw = [&] {
      return Vec3f{static_cast<float>((random->Next() - 0.5) * extent.x),
                   static_cast<float>((random->Next() - 0.5) * extent.y),
                   static_cast<float>((random->Next() - 0.5) * extent.z)};
    };
    SegmentPacket packet;
    for (int i = 0; i < 16; ++i) {
      const Vec3f from = draw();
      const bool is_short = i % 2 == 0;
      AddSegment({from, is_short ? from + (draw() - from) * 0.05F : draw()},
                 &packet);
    }
    return packet;
  }

  TemporaryFolder dir_;
  std::unique_ptr<BlockStorage> store_;
  SceneInfo scene_;
  Partition partition_;
};

TEST_F(PagedFloor, BlocksTheSameRaysAndShafts) {
  CellId receiver;
  VisibleCell source;
  FindWidestPair(&receiver, &source);
  ASSERT_GT(source.between.size(), 8U);
  Pages roomy(*this, kRoomy);
  const uint64_t before = roomy.budget.UsedBytes();
  CellsBetween together(roomy.pager, receiver, source, {});
  together.Hold();
  ASSERT_EQ(together.All().distant, nullptr);
  // Room for half of what all cells between take.
  Pages narrow(*this, (roomy.budget.UsedBytes() - before) / 2);
  CellsBetween in_turn(narrow.pager, receiver, source, {});
  in_turn.Hold();
  ASSERT_NE(in_turn.All().distant, nullptr);

  Random random(3);
  uint32_t blocked = 0;
  for (int i = 0; i < 2000; ++i) {
    const SegmentPacket packet = DrawPacket(&random);
    const uint32_t expected = together.All().Occlude(packet);
    ASSERT_EQ(in_turn.All().Occlude(packet), expected) << "packet " << i;
    blocked += static_cast<uint32_t>(std::popcount(expected));
  }
  EXPECT_GT(blocked, 8000U);
  EXPECT_LT(blocked, 30000U);

  const auto patches = roomy.pager.Geometry(receiver)->patches;
  const auto others = roomy.pager.Geometry(source.source)->patches;
  int empty = 0;
  int shaded = 0;
  constexpr int kShafts = 2000;
  for (int i = 0; i < kShafts; ++i) {
    const auto pick = [&](const std::vector<PatchGeometry>& of) {
      return random.NextBelow(static_cast<uint32_t>(of.size()));
    };
    const PatchGeometry& end = patches[pick(patches)];
    const PatchGeometry& other = others[pick(others)];
    const ShaftEnds shaft = EndsOf(end, {}, other, {});
    const bool expected = together.All().LeaveEmpty(shaft);
    ASSERT_EQ(in_turn.All().LeaveEmpty(shaft), expected) << "shaft " << i;
    empty += expected ? 1 : 0;
    const TransferEnd lit = MakeTransferEnd(end, {});
    const CastShadow shadow(lit, MakeTransferEnd(other, {}).center);
    const float sum = together.All().SumOfShadows(shadow, 0.5F);
    ASSERT_EQ(in_turn.All().SumOfShadows(shadow, 0.5F), sum) << "shaft " << i;
    shaded += sum > 0 && sum < 0.5F ? 1 : 0;
  }
  EXPECT_GT(shaded, 20);
  EXPECT_GT(empty, 0);
  EXPECT_LT(empty, kShafts);
}

// A search for victims takes as long for one as for many, so the pager evicts a
// little more than it must, and not much more.
TEST_F(PagedFloor, MakingRoomEvictsALittleMoreThanItMust) {
  constexpr uint64_t kMargin = kModest / 256;
  constexpr uint64_t kFree = 50'000;
  Pages pages(*this, kModest);
  uint64_t largest = 0;  // of all that came in for one cell
  for (size_t i = 0; i < partition_.cells.size(); ++i) {
    const uint64_t before = pages.budget.UsedBytes();
    pages.pager.BlockersOf(CellId(i));
    pages.pager.Tree(CellId(i));
    largest = std::max(largest, pages.budget.UsedBytes() - before);
  }
  const uint64_t held = pages.budget.UsedBytes();
  ASSERT_GT(held, 2 * kMargin);
  const MemoryCharge others(
      pages.budget, pages.budget.FreeBytes() - kFree, "a test");
  pages.pager.Items().MakeRoom(2 * kFree, "a test");
  pages.budget.Release(2 * kFree);
  const uint64_t left = pages.budget.UsedBytes() - others.Bytes();
  EXPECT_LE(left + kFree + kMargin, held);
  EXPECT_GE(left + kFree + kMargin + largest, held);
}

TEST_F(PagedFloor, MakesRoomForWhatGrowsBetweenHolds) {
  CellId receiver;
  VisibleCell source;
  FindWidestPair(&receiver, &source);
  Pages roomy(*this, kRoomy);
  const uint64_t before = roomy.budget.UsedBytes();
  CellsBetween all(roomy.pager, receiver, source, {});
  all.Hold();
  const uint64_t needed = roomy.budget.UsedBytes() - before;
  // So much is charged that the other memory of this process is negligible.
  Pages narrow(*this, kRoomy);
  const MemoryCharge rest(
      narrow.budget, narrow.budget.FreeBytes() - 4 * needed, "a test");
  CellsBetween between(narrow.pager, receiver, source, {});
  between.Hold();
  EXPECT_EQ(between.All().distant, nullptr);
  between.Release();
  const MemoryCharge other =
      narrow.pager.Items().Reserve(7 * needed / 2, "a tree that has grown");
  between.Hold();
  EXPECT_NE(between.All().distant, nullptr);
}

// The pager knows what a cell sends until the cell is balanced anew; pairs are
// refined by this knowledge without the tree.
TEST_F(PagedFloor, KnowsWhatACellSendsUntilThatIsForgotten) {
  constexpr uint64_t kMuch = 1 << 30;
  constexpr CellId kCell(size_t{0});
  Pages pages(*this, kMuch);
  pages.pager.StartTurn(kCell, {});
  const std::vector<float> before = pages.pager.Weights(kCell)->peaks;
  ASSERT_FALSE(before.empty());
  const auto tree = pages.pager.Tree(kCell);
  for (size_t i = 0; i < tree->Size(); ++i) {
    for (float& b : tree->Sent()[ElementId(i)]) {
      b += 1;
    }
  }
  EXPECT_EQ(pages.pager.Weights(kCell)->peaks, before);
  pages.pager.ForgetWeights(kCell);
  const std::vector<float> after = pages.pager.Weights(kCell)->peaks;
  ASSERT_EQ(after.size(), before.size());
  for (size_t i = 0; i < before.size(); ++i) {
    EXPECT_FLOAT_EQ(after[i], before[i] + 1);
  }
}

// Pinned cells cannot be evicted when the process comes near the cap.
TEST_F(PagedFloor, HoldsTogetherOnlyWhatTheProcessHasRoomFor) {
  CellId receiver;
  VisibleCell source;
  FindWidestPair(&receiver, &source);
  const std::vector<char> ballast(64 << 20, 1);
  for (const uint64_t budget_bytes : {uint64_t{24} << 20, kRoomy}) {
    Pages pages(*this, budget_bytes);
    CellsBetween between(pages.pager, receiver, source, {});
    between.Hold();
    EXPECT_EQ(between.All().distant == nullptr, budget_bytes == kRoomy);
  }
  EXPECT_EQ(ballast.back(), 1);
}

}  // namespace
}  // namespace enfilade
