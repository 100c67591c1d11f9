// The stored solution, read cell by cell and many cells together.

#include "solver/solution/solution.h"

#include "base/error.h"
#include "base/parallel.h"
#include "base/random.h"
#include "partition/partition.h"
#include "partition/partition_store.h"

#include <algorithm>
#include <atomic>
#include <memory>
#include <numeric>
#include <string>
#include <vector>

#include "tests/budgets.h"
#include "tests/tools/solved_rooms.h"
#include <gtest/gtest.h>

namespace enfilade {
namespace {

std::vector<CellId> AllCells(const Solution& solution) {
  std::vector<CellId> cells;
  for (size_t i = 0; i < solution.CellCount(); ++i) {
    cells.emplace_back(i);
  }
  return cells;
}

// Points of all cells, in no order.
std::vector<PatchPoint> ScatteredPoints(size_t count) {
  const Partition partition = LoadPartition(SolvedRooms());
  Random random(7);
  std::vector<PatchPoint> points;
  while (points.size() < count) {
    const CellId cell(
        random.NextBelow(static_cast<uint32_t>(partition.cells.size())));
    const uint32_t patches = partition.cells[cell.Index()].patches;
    if (patches > 0) {
      points.push_back({cell,
                        PatchId(random.NextBelow(patches)),
                        0.4 * random.Next(),
                        0.4 * random.Next()});
    }
  }
  return points;
}

TEST(Solution, TheDigestTellsHowFarItIs) {
  MemoryBudget budget(kRoomy);
  const Solution solution(SolvedRooms(), budget);
  std::vector<double> told;
  const std::string digest =
      solution.Digest([&](double fraction) { told.push_back(fraction); });
  EXPECT_EQ(digest, solution.Digest());
  ASSERT_EQ(told.size(), solution.CellCount());
  EXPECT_TRUE(std::is_sorted(told.begin(), told.end()));
  EXPECT_EQ(told.front(), 0);
  EXPECT_LT(told.back(), 1);
}

TEST(Solution, IsTheSameForEveryBudgetAndNumberOfThreads) {
  const auto points = ScatteredPoints(10000);  // several times what is
                                               // evaluated at a time
  MemoryBudget roomy(kRoomy);
  const Solution solution(SolvedRooms(), roomy);
  ASSERT_GT(solution.CellCount(), 4U);
  const std::vector<Rgb> values = solution.Radiosity(points);
  // Evaluates points one by one: neither their order nor their company matters.
  for (size_t i = 0; i < points.size(); i += 100) {
    EXPECT_EQ(solution.Radiosity(std::span(points).subspan(i, 1))[0],
              values[i]);
  }
  // Room for the largest cell and for nothing beside it.
  MemoryBudget tight(solution.MostCellBytes());
  EXPECT_EQ(Solution(SolvedRooms(), tight).Radiosity(points), values);
  EXPECT_LE(tight.PeakBytes(), tight.LimitBytes());
  EXPECT_EQ(tight.UsedBytes(), 0U);
  const ThreadLimit one_thread(1);
  EXPECT_EQ(solution.Radiosity(points), values);
}

TEST(Solution, IsVisitedCellByCellInTheOrderOfPoints) {
  const auto points = ScatteredPoints(6000);
  MemoryBudget budget(kRoomy);
  const Solution solution(SolvedRooms(), budget);
  const std::vector<Rgb> values = solution.Radiosity(points);
  std::vector<size_t> visited;
  solution.ForEachLight(points, [&](size_t i, const LightAtPoint& light) {
    EXPECT_EQ(light.radiosity, values[i]);
    visited.push_back(i);
  });
  std::vector<size_t> expected(points.size());
  std::iota(expected.begin(), expected.end(), size_t{0});
  std::stable_sort(expected.begin(), expected.end(), [&](size_t i, size_t j) {
    return points[i].cell < points[j].cell;
  });
  EXPECT_EQ(visited, expected);
}

TEST(Solution, OfWhichACellDoesNotFitIsRefused) {
  MemoryBudget roomy(kRoomy);
  const uint64_t most = Solution(SolvedRooms(), roomy).MostCellBytes();
  MemoryBudget small(most - 1);
  const Solution solution(SolvedRooms(), small);
  EXPECT_THROW(
      solution.VisitCells(AllCells(solution),
                          [](size_t /*i*/, const SolvedCell& /*cell*/) {}),
      DoesNotFitError);
  EXPECT_EQ(small.UsedBytes(), 0U);
}

TEST(Solution, VisitsEachCellOnceWithItsPatches) {
  MemoryBudget roomy(kRoomy);
  const Solution solution(SolvedRooms(), roomy);
  const Partition partition = LoadPartition(SolvedRooms());
  std::vector<CellId> cells = AllCells(solution);
  std::reverse(cells.begin(), cells.end());
  std::vector<std::atomic<int>> visits(cells.size());
  solution.VisitCells(cells, [&](size_t i, const SolvedCell& cell) {
    ++visits[i];
    EXPECT_EQ(cell.Patches().size(), partition.cells[cells[i].Index()].patches);
    // The leaves of a patch cover it.
    for (size_t k = 0; k < cell.Patches().size(); ++k) {
      const std::vector<PatchId> patch = {PatchId(k)};
      double area = 0;
      cell.ForEachMean(patch, [&](const LeafMean& leaf) { area += leaf.area; });
      const double whole = PatchArea(cell.Patches()[k]);
      EXPECT_NEAR(area, whole, 1e-4 * whole);
    }
  });
  for (const std::atomic<int>& count : visits) {
    EXPECT_EQ(count, 1);
  }
}

}  // namespace
}  // namespace enfilade
