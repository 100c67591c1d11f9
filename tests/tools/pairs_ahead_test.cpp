// Pairs of cells that are refined ahead of their turn, many together, get the
// links that each would get alone.

#include "solver/pairs_ahead.h"

#include "partition/partition.h"
#include "scene/import.h"
#include "solver/paging/cells_between.h"
#include "solver/refine/refined_parts.h"
#include "solver/solve.h"
#include "store/sqlite_store.h"
#include "visibility/ray_tracer.h"
#include "visibility/visible_set.h"

#include <memory>
#include <vector>

#include "tests/budgets.h"
#include "tests/solver/test_refinement.h"
#include "tests/temporary_folder.h"
#include "tools/scenes/floorplan.h"
#include <gtest/gtest.h>

namespace enfilade {
namespace {

using test::ExpectSame;

// A floor in the state in which it refines its cells for the second time, and
// a cell that receives.
class RefinedFloor : public ::testing::Test {
 protected:
  RefinedFloor() {
    const TemporaryFolder folder;
    ObjWriter writer(folder / "scene.obj");
    WriteFloorplan({12, 1, 0.2, 1}, writer);
    writer.Finish();
    ImportScene(folder / "scene.obj", {}, budget_, *store_);
    BuildVisibleSets(
        BuildPartition(*store_, {}, budget_), {}, budget_, *store_);
    BuildTraceChunks(*store_, budget_);
    SolveOptions options;
    options.error = 0.9;
    Solve(*store_, options, budget_);
    context_ = std::make_unique<SolveContext>(*store_, options, budget_);
    context_->state.phase = SolvePhase::kRefine;
    context_->pager.Order().StartSweep(SweepKind::kRefine);
    receiver_ = std::make_unique<ReceiverCell>(*context_, MostSeeing());
    const auto& patches = receiver_->geometry->patches;
    receiver_->care = CellCare(patches.size());
    receiver_->receivers =
        std::make_unique<ClusterTree>(patches, WholePatches(patches.size()));
    receiver_->weights = WeighReceiver({.id = receiver_->id,
                                        .patches = patches,
                                        .clusters = receiver_->receivers.get(),
                                        .care = receiver_->care});
  }

  [[nodiscard]] size_t Others() const { return receiver_->sources.size() - 1; }

  // Pages in all that pairs need; it stays in memory.
  void PageAllIn() {
    for (const VisibleCell& seen : receiver_->sources) {
      const SourceCell source(*context_, seen.source);
      context_->pager.Tree(seen.source);
      for (const CellId cell : seen.between) {
        context_->pager.BlockersOf(cell);
      }
    }
  }

  // The links of a pair by itself.
  std::vector<RawLink> LinksAlone(const VisibleCell& seen) {
    SourceCell source(*context_, seen.source);
    source.tree = context_->pager.Tree(seen.source);
    CellsBetween between(
        context_->pager, receiver_->id, seen, GatesBetween(*receiver_, source));
    const Refiner refiner(WorkBetween(*context_, *receiver_, source, seen),
                          *source.tree,
                          between.All());
    between.Hold();
    std::vector<RawLink> all;
    RefinedParts parts(refiner, {});
    while (!parts.AtEnd()) {
      parts.Refine();
      while (const RawLinks* links = parts.Front()) {
        all.insert(all.end(), links->links.begin(), links->links.end());
        parts.Pop();
      }
    }
    return all;
  }

  MemoryBudget budget_ = MemoryBudget(kRoomy);
  std::unique_ptr<BlockStorage> store_ = CreateStoreInMemory();
  std::unique_ptr<SolveContext> context_;
  std::unique_ptr<ReceiverCell> receiver_;

 private:
  [[nodiscard]] CellId MostSeeing() {
    CellId most(0U);
    for (size_t i = 0; i < context_->partition.cells.size(); ++i) {
      const auto seen = [&](CellId cell) {
        return context_->pager.Pairs().SeenFrom(cell).size();
      };
      most = seen(CellId(i)) > seen(most) ? CellId(i) : most;
    }
    return most;
  }
};

TEST_F(RefinedFloor, GetsTheSameLinksAheadAsAlone) {
  PageAllIn();
  PairsAhead ahead(*context_, *receiver_);
  size_t linked = 0;
  for (size_t i = 0; i < Others(); ++i) {
    const auto parts = ahead.TakeLinks(i);
    if (!parts) {
      continue;
    }
    std::vector<RawLink> links;
    for (const RawLinks& part : *parts) {
      links.insert(links.end(), part.links.begin(), part.links.end());
    }
    const std::vector<RawLink> alone = LinksAlone(receiver_->sources[i]);
    ASSERT_EQ(links.size(), alone.size()) << "source " << i;
    for (size_t k = 0; k < links.size(); ++k) {
      ExpectSame(links[k], alone[k]);
    }
    linked += links.empty() ? 0U : 1U;
  }
  EXPECT_GE(linked, 2U) << "of " << Others() << " sources";
}

TEST_F(RefinedFloor, FindsTheSameItemsAheadAsAlone) {
  PageAllIn();
  PairsAhead ahead(*context_, *receiver_);
  size_t with_work = 0;
  for (size_t i = 0; i < Others(); ++i) {
    const VisibleCell& seen = receiver_->sources[i];
    ahead.TakeLinks(i);
    if (const auto items = ahead.TakeItems(i)) {
      const SourceCell source(*context_, seen.source);
      const PairWork work = WorkBetween(*context_, *receiver_, source, seen);
      ASSERT_EQ(items->size(), work.Items().size()) << "source " << i;
      for (size_t k = 0; k < items->size(); ++k) {
        EXPECT_EQ((*items)[k].receiver, work.Items()[k].receiver);
        EXPECT_EQ((*items)[k].source, work.Items()[k].source);
      }
      with_work += items->empty() ? 0U : 1U;
    }
  }
  EXPECT_GE(with_work, 2U) << "of " << Others() << " sources";
}

TEST_F(RefinedFloor, PagesNothingInToRefineAhead) {
  context_->pager.Items().EvictAll();
  PairsAhead ahead(*context_, *receiver_);
  const uint64_t read = store_->Stats().bytes_read;
  for (size_t i = 0; i < Others(); ++i) {
    EXPECT_FALSE(ahead.TakeLinks(i).has_value()) << "source " << i;
  }
  EXPECT_EQ(store_->Stats().bytes_read, read);
}

}  // namespace
}  // namespace enfilade
