#include "solver/solution/points_by_cell.h"

#include "base/random.h"

#include <algorithm>
#include <numeric>
#include <vector>

#include <gtest/gtest.h>

namespace enfilade {
namespace {

// The order is that of a stable sort.
TEST(PointsByCell, KeepTheOrderWithinACell) {
  constexpr uint32_t kCellCount = 20;
  Random random(3);
  for (const size_t count : {size_t{0}, size_t{1}, size_t{10}, size_t{500}}) {
    std::vector<PatchPoint> points(count);
    for (PatchPoint& p : points) {
      p.cell = CellId(random.NextBelow(kCellCount));
    }
    std::vector<size_t> order(count);
    std::iota(order.begin(), order.end(), size_t{0});
    std::stable_sort(order.begin(), order.end(), [&](size_t i, size_t j) {
      return points[i].cell < points[j].cell;
    });
    const PointsByCell by_cell(points, kCellCount);
    EXPECT_TRUE(std::equal(by_cell.All().begin(),
                           by_cell.All().end(),
                           order.begin(),
                           order.end()));
    size_t seen = 0;
    std::vector<CellId> with_points;
    for (uint32_t c = 0; c < kCellCount; ++c) {
      EXPECT_EQ(by_cell.From(CellId(0U), CellId(c)).size(),
                seen + by_cell.Of(CellId(c)).size());
      for (const size_t i : by_cell.Of(CellId(c))) {
        EXPECT_EQ(i, order[seen++]);
        EXPECT_EQ(points[i].cell, CellId(c));
      }
      if (!by_cell.Of(CellId(c)).empty()) {
        with_points.emplace_back(c);
      }
    }
    EXPECT_EQ(seen, count);
    EXPECT_TRUE(std::equal(by_cell.Cells().begin(),
                           by_cell.Cells().end(),
                           with_points.begin(),
                           with_points.end()));
  }
}

}  // namespace
}  // namespace enfilade
