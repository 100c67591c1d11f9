#include "visibility/audit.h"

#include "base/parallel.h"
#include "partition/bsp_tree.h"
#include "partition/partition.h"
#include "visibility/ray_tracer.h"
#include "visibility/visible_set.h"

#include "tests/budgets.h"
#include "tests/visibility/map_storage.h"
#include "tests/visibility/test_rooms.h"
#include <gtest/gtest.h>

namespace enfilade {
namespace {

using test::MapStorage;
using test::Rectangle;

// Rooms of 2 x 2 x 2 m in a row along x, the walls between them 0.1 m thick
// and solid but for a door in the middle of y, from floor to ceiling.
struct Row {
  Partition partition;
  MapStorage store;
};

constexpr double kPitch = 2.1;

void AddWall(std::vector<Patch>& to, double x, bool faces_right) {
  for (const double y : {0.0, 1.2}) {  // the door is 0.8 < y < 1.2
    const Vec3 v{0, 0.8, 0};
    const Vec3 up{0, 0, 2};
    to.push_back(faces_right ? Rectangle({x, y, 0}, v, up)
                             : Rectangle({x, y, 0}, up, v));
  }
}

// Room i with the reveals of the door at its right end.
CellPatches Room(int i, int rooms) {
  const double x = kPitch * i;
  const bool has_door = i + 1 < rooms;
  CellPatches cell;
  cell.bounds = {{x, 0, 0}, {x + (has_door ? kPitch : 2.0), 2, 2}};
  cell.patches = test::BoxPatches({{x, 0, 0}, {x + 2, 2, 2}}, true);
  // Its walls across x are the third and the fourth.
  if (has_door) {
    cell.patches.erase(cell.patches.begin() + 3);
    AddWall(cell.patches, x + 2, false);
    const Vec3 along{0.1, 0, 0};
    const Vec3 up{0, 0, 2};
    const Vec3 wide{0, 0.4, 0};
    cell.patches.push_back(Rectangle({x + 2, 0.8, 0}, up, along));
    cell.patches.push_back(Rectangle({x + 2, 1.2, 0}, along, up));
    cell.patches.push_back(Rectangle({x + 2, 0.8, 0}, along, wide));
    cell.patches.push_back(Rectangle({x + 2, 0.8, 2}, wide, along));
  }
  if (i > 0) {
    cell.patches.erase(cell.patches.begin() + 2);
    AddWall(cell.patches, x, true);
  }
  return cell;
}

void BuildRow(int rooms, Row& row) {
  for (int i = 0; i < rooms; ++i) {
    const CellPatches cell = Room(i, rooms);
    row.store.Put({BlockKind::kCellPatches, static_cast<uint32_t>(i)},
                  EncodeCellPatches(cell));
    CellInfo info;
    info.bounds = cell.bounds;
    row.partition.cells.push_back(info);
    if (i > 0) {
      const double x = kPitch * i;
      row.partition.portals.push_back(
          {CellId(static_cast<uint32_t>(i)),
           CellId(static_cast<uint32_t>(i - 1)),
           {{x, 0.8, 0}, {x, 1.2, 0}, {x, 1.2, 2}, {x, 0.8, 2}}});
    }
  }
  MemoryBudget budget(kRoomy);
  BuildTraceChunks(row.store, budget);
}

void BuildSets(const Partition& partition, MapStorage& store) {
  MemoryBudget budget(kRoomy);
  BuildVisibleSets(partition, {}, budget, store);
}

AuditSummary AuditOf(const MapStorage& store, uint64_t rays, uint64_t bytes) {
  MemoryBudget budget(bytes);
  const AuditSummary summary = Audit(store, rays, budget, {});
  EXPECT_LE(budget.PeakBytes(), bytes);
  EXPECT_EQ(budget.UsedBytes(), 0U);
  return summary;
}

TEST(Audit, FindsAllPairsOfAnEnfiladeAndNoneMissing) {
  Row row;
  BuildRow(4, row);
  BuildSets(row.partition, row.store);
  const AuditSummary found = AuditOf(row.store, 200000, kRoomy);
  EXPECT_EQ(found.audit_rays, 200000U);
  EXPECT_EQ(found.audit_missed, 0U);
  EXPECT_EQ(found.conservative_pairs, 16U);
  EXPECT_EQ(found.sampled_pairs, 16U);
  EXPECT_LT(found.audit_leaks, 20U);
}

// The sets are those of the same rooms without the last door.
TEST(Audit, ReportsPairsThatTheSetsLack) {
  Row row;
  BuildRow(4, row);
  row.partition.portals.pop_back();
  BuildSets(row.partition, row.store);
  const AuditSummary found = AuditOf(row.store, 200000, kRoomy);
  EXPECT_EQ(found.conservative_pairs, 10U);
  EXPECT_GT(found.audit_missed, 1000U);
  ASSERT_EQ(found.first_missed.size(), 10U);
  for (const MissedPair& pair : found.first_missed) {
    EXPECT_TRUE((pair.origin == CellId(3U)) != (pair.target == CellId(3U)));
    EXPECT_LT(std::min(pair.from.x, pair.to.x), 3 * kPitch);
    EXPECT_GT(std::max(pair.from.x, pair.to.x), 3 * kPitch);
  }
}

// The sets are those of rooms whose doors are half as wide.
TEST(Audit, ReportsPartsThatTheSetsLack) {
  Row row;
  BuildRow(4, row);
  Partition narrow = row.partition;
  for (Portal& door : narrow.portals) {
    for (Point3& p : door.vertices) {
      p.y = 1 + (p.y - 1) / 2;
    }
  }
  BuildSets(narrow, row.store);
  const AuditSummary found = AuditOf(row.store, 200000, kRoomy);
  EXPECT_EQ(found.conservative_pairs, 16U);
  EXPECT_GT(found.audit_missed, 50U);
}

// Counts the rays missed by the sets of two cells, one upon the other with z =
// 0 between them, that do not see each other by their sets. One has a floor
// `depth` below, the other a ceiling.
uint64_t MissedFromBelow(double depth) {
  MapStorage store;
  CellPatches below;
  below.bounds = {{0, 0, -depth}, {2, 2, 0}};
  below.patches = {Rectangle({0, 0, -depth}, {2, 0, 0}, {0, 2, 0})};
  CellPatches above;
  above.bounds = {{0, 0, 0}, {2, 2, 2}};
  above.patches = {Rectangle({0, 0, 2}, {0, 2, 0}, {2, 0, 0})};
  store.Put({BlockKind::kCellPatches, 0}, EncodeCellPatches(below));
  store.Put({BlockKind::kCellPatches, 1}, EncodeCellPatches(above));
  Partition partition;
  partition.cells.resize(2);
  BuildSets(partition, store);
  BspTree tree;
  tree.box = {{-1, -1, -1}, {3, 3, 3}};
  tree.root = BspChild(NodeId(0U));
  // Points in the plane belong to the cell below.
  tree.nodes = {{{{0, 0, -1}, 0}, BspChild(LeafId(0U)), BspChild(LeafId(1U))}};
  tree.leaf_count = 2;
  SaveTree(tree, {CellId(0U), CellId(1U)}, store);
  MemoryBudget budget(kRoomy);
  BuildTraceChunks(store, budget);
  return AuditOf(store, 10000, kRoomy).audit_missed;
}

// If a cell is as thin as the offset of rays, rays from its floor begin in the
// plane between the cells.
TEST(Audit, ACellAsThinAsTheOffsetOfRaysProvesNothing) {
  EXPECT_GT(MissedFromBelow(1), 100U);
  EXPECT_EQ(MissedFromBelow(kRayOffsetMetres), 0U);
}

// A panel below the ceiling of the first room, seen from its lower side only.
uint64_t LeaksAtPanel(bool emits) {
  Row row;
  BuildRow(2, row);
  CellPatches room = Room(0, 2);
  room.patches.push_back(Rectangle({0.5, 0.5, 1.8}, {0, 1, 0}, {1, 0, 0}));
  room.patches.back().emits = emits;
  row.store.Put({BlockKind::kCellPatches, 0}, EncodeCellPatches(room));
  MemoryBudget budget(kRoomy);
  BuildTraceChunks(row.store, budget);
  BuildSets(row.partition, row.store);
  return AuditOf(row.store, 50000, kRoomy).audit_leaks;
}

TEST(Audit, TheBackOfALuminaireIsNoLeak) {
  EXPECT_LT(LeaksAtPanel(true), 20U);
  EXPECT_GT(LeaksAtPanel(false), 500U);
}

TEST(Audit, IsTheSameWhateverTheBudgetAndTheThreads) {
  Row row;
  BuildRow(5, row);
  BuildSets(row.partition, row.store);
  const AuditSummary much = AuditOf(row.store, 50000, kRoomy);
  const ThreadLimit one(1);
  const AuditSummary little = AuditOf(row.store, 50000, 12 << 20);
  EXPECT_EQ(much.sampled_pairs, little.sampled_pairs);
  EXPECT_EQ(much.audit_leaks, little.audit_leaks);
  EXPECT_EQ(much.audit_rays, little.audit_rays);
}

}  // namespace
}  // namespace enfilade
