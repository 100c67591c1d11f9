#include "visibility/beam_flood.h"

#include "base/error.h"
#include "base/memory.h"
#include "base/planar_polygon.h"
#include "visibility/set_agreement.h"

#include <algorithm>
#include <array>
#include <functional>
#include <span>
#include <utility>
#include <vector>

#include "tests/visibility/map_storage.h"
#include <gtest/gtest.h>

namespace enfilade {
namespace {

// An upright rectangle across x, one metre high.
std::vector<Point3> Across(double x, double y0, double y1) {
  return {{x, y0, 0}, {x, y1, 0}, {x, y1, 1}, {x, y0, 1}};
}

// A cell from x0 to x1, as high as the doors and wider than all of them.
Box3 Between(double x0, double x1) {
  return {{x0, -10, 0}, {x1, 20, 1}};
}

struct Regions {
  std::vector<CellId> cell_of;
  std::vector<Portal> openings;
};

// The cells with these bounds that cell 0 sees, and the parts of them.
ReachedParts SeenOf(const Regions& regions, std::vector<Box3> bounds) {
  MemoryBudget budget(1U << 30);
  const RegionGraph graph(
      bounds.size(),
      regions.cell_of,
      [&regions](const std::function<void(const Portal&)>& visit) {
        std::for_each(regions.openings.begin(), regions.openings.end(), visit);
      },
      budget);
  ReachedParts reached(std::move(bounds));
  BeamFlood flood(graph);
  EXPECT_TRUE(flood.Run(graph.DoorwaysOut(CellId(0U)), &reached));
  return reached;
}

std::vector<bool> CellsOf(const ReachedParts& reached, size_t cells) {
  std::vector<bool> seen;
  for (size_t i = 0; i < cells; ++i) {
    seen.push_back(reached.Holds(CellId(i)));
  }
  return seen;
}

// Cell 0, a cell 1 of two regions with a wall between them that is open from
// `gap` to y = 3, and cell 2; the doors of cell 1 face each other at y < 1.
std::vector<bool> SeenFromCell0(double gap) {
  Regions regions;
  regions.cell_of = {CellId(0U), CellId(1U), CellId(1U), CellId(2U)};
  const auto open = [&](uint32_t region, const std::vector<Point3>& vertices) {
    regions.openings.push_back({CellId(region + 1), CellId(region), vertices});
  };
  open(0, Across(1, 0, 1));
  open(1, Across(2, gap, 3));
  open(2, Across(3, 0, 1));
  return CellsOf(SeenOf(regions, {Between(0, 1), Between(1, 3), Between(3, 4)}),
                 3);
}

// A line from one door past the wall rises out of reach of the other door.
TEST(BeamFlood, KnowsTheWallsWithinACell) {
  EXPECT_EQ(SeenFromCell0(2.5), (std::vector<bool>{false, true, false}));
  EXPECT_EQ(SeenFromCell0(0), (std::vector<bool>{false, true, true}));
}

// The line from the top of one door past the lower end of the wall to the top
// of the other door is straight: y = 1.
TEST(BeamFlood, MillimetresDecide) {
  EXPECT_TRUE(SeenFromCell0(0.999)[2]);
  EXPECT_FALSE(SeenFromCell0(1.001)[2]);
}

// A row of cells behind each other with a door at x = 1, 2, ... between them.
ReachedParts PartsAlong(const std::vector<std::array<double, 2>>& doors) {
  Regions regions;
  std::vector<Box3> bounds;
  for (size_t i = 0; i <= doors.size(); ++i) {
    regions.cell_of.emplace_back(i);
    bounds.push_back(
        Between(static_cast<double>(i), static_cast<double>(i) + 1));
  }
  for (size_t i = 0; i < doors.size(); ++i) {
    regions.openings.push_back(
        {CellId(i + 1),
         CellId(i),
         Across(static_cast<double>(i) + 1, doors[i][0], doors[i][1])});
  }
  return SeenOf(regions, std::move(bounds));
}

std::vector<bool> SeenAlong(const std::vector<std::array<double, 2>>& doors) {
  return CellsOf(PartsAlong(doors), doors.size() + 1);
}

// Lines through the second and the third door rise by 0.9 to 1 per metre. Some
// lines through the first and the third door alone rise by only 0.45 and would
// reach the last door.
TEST(BeamFlood, HoldsALineToEveryDoorItHasPassed) {
  EXPECT_FALSE(SeenAlong({{0, 1}, {0.9, 1}, {1.9, 2}, {2.3, 2.5}})[4]);
  EXPECT_TRUE(SeenAlong({{0, 1}, {0.9, 1}, {1.9, 2}, {2.3, 3}})[4]);
  EXPECT_TRUE(SeenAlong({{0, 1}, {0.9, 1.7}, {1.9, 2}, {2.3, 2.5}})[4]);
}

// The cells seen in a row of six. Two doors, one of them from `y0` to `y1`,
// lead from the first door to the third.
std::vector<bool> SeenByTwoWays(double y0, double y1) {
  constexpr size_t kCells = 6;
  Regions regions;
  std::vector<Box3> bounds;
  for (size_t i = 0; i < kCells; ++i) {
    regions.cell_of.emplace_back(i);
    bounds.push_back(
        Between(static_cast<double>(i), static_cast<double>(i) + 1));
  }
  const auto open =
      [&](uint32_t from, uint32_t to, double x, double low, double high) {
        regions.openings.push_back(
            {CellId(to), CellId(from), Across(x, low, high)});
      };
  open(0, 1, 1, 0, 1);
  open(1, 2, 2, 0.9, 1);
  open(1, 2, 2, y0, y1);
  open(2, 3, 3, 1.9, 2);
  open(3, 4, 4, 2.3, 2.5);
  open(4, 5, 5, 2.6, 3);
  return CellsOf(SeenOf(regions, std::move(bounds)), kCells);
}

// What the flood knows of one way does not hold for the other.
TEST(BeamFlood, ForgetsADoorThatCanBePassedBy) {
  EXPECT_TRUE(SeenByTwoWays(1.4, 1.5)[4]);
}

// The middle of the second door is so far off that the flood has looked through
// what lies behind both doors before.
TEST(BeamFlood, LooksAgainWhereAnotherWayIsFoundLater) {
  const std::vector<bool> seen = SeenByTwoWays(1.4, 9);
  EXPECT_TRUE(seen[4]);
  EXPECT_TRUE(seen[5]);
}

// A line that has left the plane of a door does not come back into that plane.
TEST(BeamFlood, PassesAPlaneOnce) {
  Regions regions;
  regions.cell_of = {CellId(0U), CellId(1U), CellId(2U)};
  regions.openings.push_back({CellId(1U), CellId(0U), Across(1, 0, 1)});
  regions.openings.push_back({CellId(1U), CellId(2U), Across(1, 1, 2)});
  EXPECT_EQ(
      CellsOf(SeenOf(regions, {Between(0, 1), Between(1, 2), Between(0, 1)}),
              3),
      (std::vector<bool>{false, true, false}));
}

// Doors at x = 1, 2 and 3 extend from y = 0 to 1: the steepest lines through
// the first and the last one rise, or fall, by a half per metre.
TEST(BeamFlood, TellsWhatPartOfACellIsSeen) {
  constexpr double kTolerance = 2e-3;  // of every door, times what it spreads
  const ReachedParts parts = PartsAlong({{0, 1}, {0, 1}, {0, 1}});
  const auto expect_rises_to = [&](uint32_t cell, double rise) {
    const Box3& part = parts.Of(CellId(cell));
    EXPECT_NEAR(part.low.y, -rise, kTolerance) << cell;
    EXPECT_NEAR(part.high.y, 1 + rise, kTolerance) << cell;
    EXPECT_LE(part.low.y, -rise) << "nothing is left out";
    EXPECT_GE(part.high.y, 1 + rise) << "nothing is left out";
    EXPECT_NEAR(part.low.x, cell, kTolerance);
    EXPECT_EQ(part.high.x, cell + 1.0);
  };
  EXPECT_EQ(parts.Of(CellId(1U)).high.y, 20) << "all of the next cell";
  expect_rises_to(2, 1);
  expect_rises_to(3, 0.5);
}

// The cell lies beside all lines that come through the door.
TEST(BeamFlood, ACellWithoutAPartIsNotReached) {
  Regions regions;
  regions.cell_of = {CellId(0U), CellId(1U), CellId(2U)};
  regions.openings.push_back({CellId(1U), CellId(0U), Across(1, 0, 1)});
  regions.openings.push_back({CellId(2U), CellId(1U), Across(2, 0, 1)});
  const auto is_reached = [&](double y) {
    return SeenOf(regions,
                  {Between(0, 1), Between(1, 2), {{2, y, 0}, {3, y + 1, 1}}})
        .Holds(CellId(2U));
  };
  EXPECT_TRUE(is_reached(1.9));
  EXPECT_FALSE(is_reached(2.1));
}

TEST(Doorways, LeadBothWaysThroughAPortal) {
  const std::vector<Portal> portals = {
      {CellId(1U), CellId(0U), Across(1, 0, 1)},
      {CellId(1U), CellId(1U), Across(2, 0, 1)},  // leads nowhere
      {CellId(1U), CellId(2U), Across(3, 0, 2)}};
  MemoryBudget budget(1U << 20);
  {
    const PortalGraph graph(
        3,
        [&portals](const std::function<void(const Portal&)>& visit) {
          std::for_each(portals.begin(), portals.end(), visit);
        },
        budget);
    EXPECT_GE(budget.UsedBytes(), 4 * sizeof(Doorway) + 8 * sizeof(Point3));
    EXPECT_EQ(graph.DoorwayCount(), 4U);
    ASSERT_EQ(graph.Doorways(CellId(1U)).size(), 2U);
    ASSERT_EQ(graph.Doorways(CellId(2U)).size(), 1U);
    const Doorway& there = graph.Doorways(CellId(1U))[1];
    const Doorway& back = graph.Doorways(CellId(2U))[0];
    EXPECT_EQ(there.to, CellId(2U));
    EXPECT_EQ(back.to, CellId(1U));
    EXPECT_EQ(there.portal, back.portal);
    EXPECT_NE(there.index, back.index);
    EXPECT_EQ(there.plane.normal, -back.plane.normal);
    std::vector<Point3> vertices = there.polygon.Copy();
    EXPECT_EQ(AreaVector(vertices), there.plane.normal * 2);
    std::reverse(vertices.begin(), vertices.end());
    EXPECT_EQ(back.polygon.Copy(), vertices);
  }
  EXPECT_EQ(budget.UsedBytes(), 0U);
}

TEST(GroupDoorways, LosesNoneAndTellsDirectionsApart) {
  std::vector<Doorway> doors(40);
  std::vector<std::vector<Point3>> polygons(doors.size());
  DoorwayGroup all;
  for (size_t i = 0; i < doors.size(); ++i) {
    const double x = static_cast<double>(i);
    polygons[i] = Across(x, 0, 1);
    doors[i].polygon = Outline::Forward(polygons[i]);
    doors[i].center = {x, 0.5, 0.5};
    doors[i].plane.normal = {i % 2 == 0 ? 1.0 : -1.0, 0, 0};
    all.push_back(&doors[i]);
  }
  size_t count = 0;
  const auto groups = GroupDoorways(all);
  EXPECT_LE(groups.size(), 12U);
  for (const DoorwayGroup& group : groups) {
    for (const Doorway* door : group) {
      EXPECT_EQ(door->plane.normal, group[0]->plane.normal);
    }
    count += group.size();
  }
  EXPECT_EQ(count, doors.size());
}

// Every cell is seen, either with all cells between or, if `is_loose`, loosely
// and without any.
std::vector<SeenCell> AllSeen(size_t cells, bool is_loose) {
  std::vector<SeenCell> seen;
  for (size_t i = 0; i < cells; ++i) {
    seen.push_back({CellId(i), is_loose});
    for (size_t k = 0; k < (is_loose ? 0 : cells); ++k) {
      seen.back().between.emplace_back(k);
    }
  }
  return seen;
}

test::MapStorage AgreedUnder(MemoryBudget& budget) {
  constexpr size_t kCells = 60;
  Partition row;
  for (uint32_t i = 0; i < kCells; ++i) {
    const double x = i;
    row.cells.emplace_back().bounds = {{x, 0, 0}, {x + 1, 1, 1}};
  }
  test::MapStorage store;
  SetAgreement sets(row.cells, budget, store);
  for (size_t i = 0; i < kCells; ++i) {
    sets.Put(CellId(i), AllSeen(kCells, i % 3 == 0));
  }
  sets.Agree();
  for (size_t i = 0; i < kCells; ++i) {
    EXPECT_EQ(sets.Finish(CellId(i)), kCells);
  }
  return store;
}

TEST(SetAgreement, ReadsAsMuchAtOnceAsTheBudgetHolds) {
  MemoryBudget roomy(uint64_t{1} << 30);
  const test::MapStorage sets = AgreedUnder(roomy);
  EXPECT_EQ(roomy.UsedBytes(), 0U);
  EXPECT_GT(roomy.PeakBytes(), 500'000U);
  MemoryBudget small(100'000);
  EXPECT_EQ(AgreedUnder(small).Blocks(), sets.Blocks());
  MemoryBudget none(10'000);
  EXPECT_THROW(AgreedUnder(none), DoesNotFitError);
}

TEST(VisibleSetBlock, ComesBackAsItWent) {
  VisibleSet set;
  for (uint32_t i = 0; i < 20; ++i) {
    VisibleCell visible{CellId(3 * i), {}};
    visible.of_receiver.low[i % 3] = static_cast<uint8_t>(i);
    visible.of_source.high[i % 3] = static_cast<uint8_t>(200 + i);
    for (uint32_t k = 0; k < 20; k += 1 + i % 3) {
      visible.between.emplace_back(3 * k);
    }
    set.push_back(visible);
  }
  uint64_t told = 0;
  const Bytes block = EncodeVisibleSet(
      set, [&](size_t i) { return std::span(set[i].between); });
  const VisibleSet back =
      DecodeVisibleSet(block, [&](uint64_t bytes) { told = bytes; });
  EXPECT_EQ(told, BytesOf(set));
  ASSERT_EQ(back.size(), set.size());
  for (size_t i = 0; i < set.size(); ++i) {
    EXPECT_EQ(back[i].source, set[i].source);
    EXPECT_EQ(back[i].between, set[i].between);
    EXPECT_EQ(back[i].of_receiver, set[i].of_receiver);
    EXPECT_EQ(back[i].of_source, set[i].of_source);
    EXPECT_EQ(back[i].between.capacity(), back[i].between.size());
  }
}

}  // namespace
}  // namespace enfilade
