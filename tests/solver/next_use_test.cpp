// What is evicted first is what is needed last.

#include "solver/next_use.h"

#include "store/sqlite_store.h"
#include "visibility/visible_set.h"

#include <memory>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace enfilade {
namespace {

// Rooms in a row.
std::unique_ptr<BlockStorage> RowOfRooms(size_t cells) {
  auto store = CreateStoreInMemory();
  Partition partition;
  for (size_t i = 0; i < cells; ++i) {
    const auto x = static_cast<double>(i);
    CellInfo cell;
    cell.bounds = {{x, 0, 0}, {x + 1, 1, 1}};
    partition.cells.push_back(cell);
  }
  // Doors at alternate ends of the walls: a room sees its neighbours only.
  for (size_t i = 0; i + 1 < cells; ++i) {
    const auto x = static_cast<double>(i + 1);
    const double y = i % 2 == 0 ? 0 : 0.9;
    partition.portals.push_back(
        {CellId(i + 1),
         CellId(i),
         {{x, y, 0}, {x, y + 0.1, 0}, {x, y + 0.1, 0.1}, {x, y, 0.1}}});
  }
  BuildVisibleSets(partition, {}, *store);
  return store;
}

// The pairs of a round in the order of the work.
std::vector<std::pair<CellId, CellId>> Order(const BlockStorage& store,
                                             size_t cells) {
  std::vector<std::pair<CellId, CellId>> order;
  for (size_t r = 0; r < cells; ++r) {
    for (const VisibleCell& v : LoadVisibleSet(store, CellId(r))) {
      if (v.source != CellId(r)) {
        order.emplace_back(CellId(r), v.source);
      }
    }
    order.emplace_back(CellId(r), CellId(r));
  }
  return order;
}

// The rule, against the schedule itself: the farther the use, the larger the
// distance.
TEST(NextUse, OrdersCellsAsTheScheduleDoes) {
  constexpr size_t kCells = 6;
  const auto store = RowOfRooms(kCells);
  const auto order = Order(*store, kCells);
  ASSERT_LT(order.size(), kCells * kCells) << "not all rooms see each other";
  MemoryBudget budget(1 << 20);
  NextUse next(*store, kCells, budget);
  EXPECT_EQ(
      budget.UsedBytes(),
      NextUse::BytesFor(kCells, LoadVisibilitySummary(*store).visible_pairs));
  for (size_t at = 0; at < order.size(); ++at) {
    next.MoveTo(order[at].first, order[at].second);
    // Steps to the next pair with the cell, around the end of the round.
    const auto steps = [&](CellId cell) {
      size_t k = 0;
      while (order[(at + k) % order.size()].first != cell &&
             order[(at + k) % order.size()].second != cell) {
        ++k;
      }
      return k;
    };
    for (size_t i = 0; i < kCells; ++i) {
      for (size_t k = 0; k < kCells; ++k) {
        if (steps(CellId(i)) < steps(CellId(k))) {
          EXPECT_LE(next.Distance(CellId(i)), next.Distance(CellId(k)))
              << "cells " << i << " and " << k << " at step " << at;
        }
      }
    }
    EXPECT_EQ(next.Distance(order[at].second), 0U);
  }
}

}  // namespace
}  // namespace enfilade
