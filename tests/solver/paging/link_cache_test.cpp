// Links are read once where there is room for them.

#include "solver/paging/link_cache.h"

#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "tests/budgets.h"
#include "tests/solver/row_of_rooms.h"
#include <gtest/gtest.h>

namespace enfilade {
namespace {

constexpr CellPair kKeptPair{CellId(1U), CellId(2U)};
constexpr LinkEnds kKeptEnds{100, 100, 0};
constexpr size_t kKeptChunks = 3;

class LinksInRow : public ::testing::Test {
 protected:
  LinksInRow() {
    order_.StartSweep(SweepKind::kPropagate);
    order_.MoveTo(kKeptPair.receiver, kKeptPair.source);
    ChunkWriter writer(*row_.store, [&](LinkChunk&& chunk) {
      written_.push_back(std::move(chunk));
    });
    for (uint32_t chunk = 0; chunk < kKeptChunks; ++chunk) {
      LinkBlock block;
      Link link;
      link.receiver = chunk;
      link.kind = LinkKind::kWeak;
      link.value = 1;
      block.links.push_back(link);
      writer.Start({kKeptPair, chunk, std::move(block), 0});
      writer.Finish();
    }
  }

  // The receivers of the pair's links, and whether the store was read.
  std::pair<std::vector<uint32_t>, bool> Visit() {
    const uint64_t before = row_.store->Stats().bytes_read;
    std::vector<uint32_t> receivers;
    links_.Visit(kKeptPair, kKeptEnds, [&](const LinkBlock& block) {
      for (const Link& link : block.links) {
        receivers.push_back(link.receiver);
      }
    });
    return {receivers, row_.store->Stats().bytes_read > before};
  }

  test::RowOfRooms row_{3};
  MemoryBudget budget_{kRoomy};
  PairTable pairs_{*row_.store, 3, budget_};
  NextUse order_{pairs_, budget_};
  ItemCache items_{
      order_, budget_, [](const ItemKey&, const void*) { return 0; }};
  LinkCache links_{*row_.store, items_};
  std::vector<LinkChunk> written_;
};

using LinksVisited = std::pair<std::vector<uint32_t>, bool>;
const std::vector<uint32_t> kAllReceivers = {0, 1, 2};

TEST_F(LinksInRow, AreReadOnceWhereThereIsRoom) {
  EXPECT_EQ(Visit(), LinksVisited(kAllReceivers, true));
  EXPECT_EQ(Visit(), LinksVisited(kAllReceivers, false));
  links_.Forget();
  EXPECT_EQ(Visit(), LinksVisited(kAllReceivers, true));
}

TEST_F(LinksInRow, AreReadAgainWhereThereIsNoRoom) {
  const MemoryCharge others(budget_, budget_.FreeBytes(), "others");
  EXPECT_EQ(Visit(), LinksVisited(kAllReceivers, true));
  EXPECT_EQ(Visit(), LinksVisited(kAllReceivers, true));
}

TEST_F(LinksInRow, AreNotReadWhereTheyWereKept) {
  ASSERT_EQ(written_.size(), kKeptChunks);
  for (LinkChunk& chunk : written_) {
    links_.Keep(std::move(chunk));
  }
  EXPECT_EQ(Visit(), LinksVisited(kAllReceivers, false));
  EXPECT_EQ(items_.Trace().TakeReads().belady, 0U) << "they were made here";
}

}  // namespace
}  // namespace enfilade
