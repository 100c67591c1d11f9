// What is needed last is evicted first.

#include "solver/paging/next_use.h"

#include "visibility/visible_set.h"

#include <algorithm>
#include <functional>
#include <memory>
#include <utility>
#include <vector>

#include "tests/budgets.h"
#include "tests/solver/row_of_rooms.h"
#include <gtest/gtest.h>

namespace enfilade {
namespace {

using test::RowOfRooms;

// A receiver and its source, one pair of a sweep.
struct Pair {
  CellId receiver;
  VisibleCell source;
};

// The pairs of a sweep in the order of the work.
std::vector<Pair> Order(const BlockStorage& store, size_t cells) {
  std::vector<Pair> order;
  for (size_t r = 0; r < cells; ++r) {
    VisibleCell self{CellId(r), {CellId(r)}};
    for (const VisibleCell& v : LoadVisibleSet(store, CellId(r))) {
      if (v.source != CellId(r)) {
        order.push_back({CellId(r), v});
      }
    }
    order.push_back({CellId(r), self});
  }
  return order;
}

// A row of rooms and the order of its sweeps.
class NextUseInRow : public ::testing::Test {
 protected:
  static constexpr size_t kCells = 6;

  void SetUp() override {
    order_ = Order(*store_, kCells);
    ASSERT_LT(order_.size(), kCells * kCells) << "all rooms see each other";
  }

  // Steps from `from` to the next wanted pair, around the end of the sweep.
  size_t Steps(size_t from, const std::function<bool(const Pair&)>& is_wanted) {
    size_t k = 0;
    while (k < 2 * order_.size() &&
           !is_wanted(order_[(from + k) % order_.size()])) {
      ++k;
    }
    return k;
  }

  // Tells `next` of the work, from the beginning of the receiver's turn.
  void MoveTo(size_t at, NextUse* next) {
    const Pair& pair = order_[at];
    std::vector<VisibleCell> sources;
    for (const Pair& p : order_) {
      if (p.receiver == pair.receiver) {
        sources.push_back(p.source);
      }
    }
    next->StartTurn(pair.receiver, sources);
    next->MoveTo(pair.receiver, pair.source.source);
  }

  const std::unique_ptr<BlockStorage> store_ = RowOfRooms(kCells).store;
  std::vector<Pair> order_;
  MemoryBudget budget_{kRoomy};
};

// Checks the rule against the schedule itself: the later the use, the larger
// the distance.
template <typename Distance, typename StepsTo>
void ExpectSameOrder(const Distance& distance, const StepsTo& steps) {
  for (size_t i = 0; i < 6; ++i) {
    for (size_t k = 0; k < 6; ++k) {
      if (steps(CellId(i)) < steps(CellId(k))) {
        EXPECT_LT(distance(CellId(i)), distance(CellId(k)))
            << "cells " << i << " and " << k;
      }
    }
  }
}

TEST_F(NextUseInRow, OrdersCellsAsPropagationDoes) {
  PairTable pairs(*store_, kCells, budget_);
  NextUse next(pairs, budget_);
  EXPECT_EQ(budget_.UsedBytes(),
            PairTable::BytesFor(kCells,
                                LoadVisibilitySummary(*store_).visible_pairs));
  for (const Pair& p : order_) {
    pairs.SetLinked(p.receiver, p.source.source, true);
  }
  next.StartSweep(SweepKind::kPropagate);
  for (size_t at = 0; at < order_.size(); ++at) {
    MoveTo(at, &next);
    ExpectSameOrder([&](CellId c) { return next.OfCell(c); },
                    [&](CellId c) {
                      return Steps(at, [&](const Pair& p) {
                        return p.receiver == c || p.source.source == c;
                      });
                    });
    EXPECT_EQ(next.OfCell(order_[at].source.source), 0U);
    EXPECT_EQ(next.OfCell(order_[at].receiver), 0U);
  }
}

// What a cell has received is needed in that cell's own turn only.
TEST_F(NextUseInRow, OrdersWhatIsReceivedByTurns) {
  PairTable pairs(*store_, kCells, budget_);
  NextUse next(pairs, budget_);
  for (const Pair& p : order_) {
    pairs.SetLinked(p.receiver, p.source.source, true);
  }
  for (const SweepKind kind : {SweepKind::kRefine, SweepKind::kPropagate}) {
    next.StartSweep(kind);
    for (size_t at = 0; at < order_.size(); ++at) {
      MoveTo(at, &next);
      const auto steps = [&](CellId c) {
        return Steps(at, [&](const Pair& p) { return p.receiver == c; });
      };
      for (size_t i = 0; i < kCells; ++i) {
        EXPECT_EQ(next.OfTurn(CellId(i)) == 0, steps(CellId(i)) == 0);
        for (size_t k = 0; k < kCells; ++k) {
          if (steps(CellId(i)) < steps(CellId(k))) {
            EXPECT_LT(next.OfTurn(CellId(i)), next.OfTurn(CellId(k)))
                << "cells " << i << " and " << k << " at step " << at;
          }
        }
      }
    }
  }
}

// What a cell has sent is needed where others gather it, but not while links
// are made, which takes the whole tree.
TEST_F(NextUseInRow, OrdersNewsByThoseWhoGatherThem) {
  PairTable pairs(*store_, kCells, budget_);
  NextUse next(pairs, budget_);
  for (const Pair& p : order_) {
    pairs.SetLinked(p.receiver, p.source.source, true);
  }
  const auto is_news_of = [](const Pair& p, CellId c) {
    return p.source.source == c && p.receiver != c;
  };
  for (size_t at = 0; at < order_.size(); ++at) {
    next.StartSweep(SweepKind::kPropagate);
    MoveTo(at, &next);
    ExpectSameOrder([&](CellId c) { return next.OfNews(c); },
                    [&](CellId c) {
                      return Steps(
                          at, [&](const Pair& p) { return is_news_of(p, c); });
                    });
    for (size_t i = 0; i < kCells; ++i) {
      EXPECT_EQ(next.OfTree(CellId(i)), next.OfTurn(CellId(i)));
    }

    next.StartSweep(SweepKind::kRefine);
    MoveTo(at, &next);
    ExpectSameOrder([&](CellId c) { return next.OfNews(c); },
                    [&](CellId c) {
                      return order_.size() - at + Steps(0, [&](const Pair& p) {
                               return is_news_of(p, c);
                             });
                    });
    for (size_t i = 0; i < kCells; ++i) {
      EXPECT_EQ(next.OfTree(CellId(i)), next.OfCell(CellId(i)));
    }
  }
}

// Pairs without links do not count in propagation.
TEST_F(NextUseInRow, LeavesOutPairsWithoutLinks) {
  PairTable pairs(*store_, kCells, budget_);
  NextUse next(pairs, budget_);
  const auto is_linked = [](const Pair& p) {
    return (p.receiver.value + 2 * p.source.source.value) % 3 != 0;
  };
  for (const Pair& p : order_) {
    pairs.SetLinked(p.receiver, p.source.source, is_linked(p));
    EXPECT_EQ(pairs.IsLinked(p.receiver, p.source.source), is_linked(p));
  }
  next.StartSweep(SweepKind::kPropagate);
  for (size_t at = 0; at < order_.size(); ++at) {
    MoveTo(at, &next);
    ExpectSameOrder([&](CellId c) { return next.OfCell(c); },
                    [&](CellId c) {
                      return Steps(at, [&](const Pair& p) {
                        return p.receiver == c ||
                               (p.source.source == c && is_linked(p));
                      });
                    });
  }
}

// A receiver does not look again at a source that has not changed since it
// looked.
TEST_F(NextUseInRow, LeavesOutSourcesWithoutNews) {
  PairTable pairs(*store_, kCells, budget_);
  NextUse next(pairs, budget_);
  std::vector<CellRow> rows(kCells);
  for (size_t i = 0; i < kCells; ++i) {
    rows[i].processed = 10;
    rows[i].published = i == 3 ? 11 : 9;
  }
  next.Watch(rows);
  for (const Pair& p : order_) {
    pairs.SetLinked(p.receiver, p.source.source, true);
  }
  next.StartSweep(SweepKind::kPropagate);
  next.StartTurn(CellId(2U), {});
  next.MoveTo(CellId(2U), CellId(2U));
  // Cell 4 sees cell 3, which has news, and so has its turn. Cell 3 has nothing
  // new to gather except what cell 2 may have in a moment.
  EXPECT_LT(next.OfCell(CellId(3U)), next.OfCell(CellId(4U)));
  EXPECT_LT(next.OfCell(CellId(4U)), next.OfCell(CellId(1U)));
  rows[3].published = 9;
  EXPECT_LT(next.OfCell(CellId(3U)), next.OfCell(CellId(5U)));
}

TEST_F(NextUseInRow, KnowsWhatStandsBetweenInATurn) {
  PairTable pairs(*store_, kCells, budget_);
  NextUse next(pairs, budget_);
  next.StartSweep(SweepKind::kRefine);
  for (size_t at = 0; at < order_.size(); ++at) {
    MoveTo(at, &next);
    const CellId receiver = order_[at].receiver;
    const CellId source = order_[at].source.source;
    // Each source has its place in the turn, and the receiver itself comes
    // last.
    const size_t left = source == receiver ? 0 : kCells - source.Index();
    for (size_t i = 0; i < kCells; ++i) {
      const size_t steps = Steps(at, [&](const Pair& p) {
        const auto& between = p.source.between;
        return std::find(between.begin(), between.end(), CellId(i)) !=
               between.end();
      });
      const bool in_turn =
          at + steps < order_.size() && order_[at + steps].receiver == receiver;
      EXPECT_EQ(next.OfBlockers(CellId(i)) <= left, in_turn)
          << "cell " << i << " at step " << at;
      EXPECT_EQ(next.OfBlockers(CellId(i)) == 0, steps == 0);
    }
  }
  next.StartSweep(SweepKind::kPropagate);
  EXPECT_EQ(next.OfBlockers(CellId(0U)), NextUse::kNever);
}

// The budget may have room for the order of a turn although the process has
// none.
TEST_F(NextUseInRow, HoldsTheOrderOfATurnWhereTheProcessHasRoom) {
  const std::vector<char> ballast(64 << 20, 1);
  MemoryBudget narrow(1 << 20);
  for (MemoryBudget* budget : {&budget_, &narrow}) {
    const PairTable pairs(*store_, kCells, *budget);
    NextUse next(pairs, *budget);
    const uint64_t before = budget->UsedBytes();
    MoveTo(0, &next);
    EXPECT_EQ(budget->UsedBytes() > before, budget == &budget_);
  }
  EXPECT_EQ(ballast.back(), 1);
}

// The links of a pair are read once in a sweep, those of a cell with itself
// again and again at the end of the cell's turn.
TEST_F(NextUseInRow, OrdersLinksAsTheyAreRead) {
  PairTable pairs(*store_, kCells, budget_);
  NextUse next(pairs, budget_);
  next.StartSweep(SweepKind::kPropagate);
  for (size_t at = 0; at < order_.size(); ++at) {
    MoveTo(at, &next);
    for (size_t k = 1; k < order_.size(); ++k) {
      const Pair& sooner = order_[(at + k) % order_.size()];
      const Pair& later = order_[(at + k + 1) % order_.size()];
      if (sooner.source.source == order_[at].receiver ||
          later.source.source == order_[at].receiver) {
        continue;  // of the cell with itself, or sends back
      }
      EXPECT_LT(next.OfLinks(sooner.receiver, sooner.source.source),
                k + 1 < order_.size()
                    ? next.OfLinks(later.receiver, later.source.source)
                    : NextUse::kNever);
    }
    const CellId receiver = order_[at].receiver;
    EXPECT_LE(next.OfLinks(receiver, receiver), kCells + 2);
  }
  next.StartSweep(SweepKind::kRefine);
  MoveTo(0, &next);
  EXPECT_EQ(next.OfLinks(CellId(4U), CellId(3U)), NextUse::kNever)
      << "refinement will replace them";
}

}  // namespace
}  // namespace enfilade
