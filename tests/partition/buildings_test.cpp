// Real buildings, where their folder exists (real_buildings.h).

#include "base/photometry.h"
#include "partition/partition.h"

#include <algorithm>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include "tests/partition/boundary_check.h"
#include "tests/partition/real_buildings.h"
#include "tests/partition/test_scenes.h"
#include <gtest/gtest.h>

namespace enfilade {
namespace {

using testing::Building;
using testing::Import;
using testing::RandomPointIn;

// The same polygons with everything else forgotten.
std::unique_ptr<BlockStorage> Stripped(const Building& building) {
  auto store = CreateStoreInMemory();
  SceneWriter writer(*store);
  ForEachFace(*building.store, [&writer](FaceId, const Face& face) {
    Face bare = face;
    bare.front_space.reset();
    bare.back_space.reset();
    writer.Add(bare);
  });
  SceneInfo info = building.info;
  info.spaces.clear();
  info.openings.clear();
  writer.Finish(std::move(info));
  return store;
}

class Buildings : public testing::RealBuildings {
 protected:
  MemoryBudget budget_{200ULL << 20};
};

class GbxmlBuildings : public Buildings {};

TEST_P(GbxmlBuildings, EverySpaceIsACell) {
  const Building building = Import(GetParam(), budget_);
  const Partition partition = BuildPartition(*building.store, {}, budget_);
  std::multiset<uint32_t> spaces;
  for (const CellInfo& cell : partition.cells) {
    if (cell.space) {
      spaces.insert(cell.space->value);
    }
  }
  size_t closed = 0;
  for (uint32_t i = 0; i < building.info.spaces.size(); ++i) {
    if (building.info.spaces[i].closed) {
      ++closed;
      EXPECT_EQ(spaces.count(i), 1U) << building.info.spaces[i].name;
    }
  }
  EXPECT_GT(closed, 0U);
}

// Walls that are closed in the file are closed in the partition, although the
// file's coordinates are rounded.
TEST_P(GbxmlBuildings, PortalsLieInTheOpeningsThatTheFileNames) {
  constexpr double kNearM = 0.01;
  const Building building = Import(GetParam(), budget_);
  PartitionOptions options;
  options.max_cell_patches = 1'000'000;  // no artificial walls, all portal
  const Partition partition = BuildPartition(*building.store, options, budget_);
  EXPECT_EQ(partition.portals.empty(), building.info.openings.empty());
  for (const Portal& portal : partition.portals) {
    const Point3 middle = VertexMean(portal.vertices);
    const auto& openings = building.info.openings;
    EXPECT_TRUE(std::any_of(openings.begin(),
                            openings.end(),
                            [&](const Opening& opening) {
                              return testing::IsInPolygon(
                                  opening.vertices, middle, kNearM);
                            }))
        << "cells " << portal.front.value << " and " << portal.back.value
        << " at " << middle.x << " " << middle.y << " " << middle.z;
  }
}

constexpr uint32_t kOutside = ~0U;
using SpacePair = std::pair<uint32_t, uint32_t>;

// The pairs of Spaces, or of a Space and the outside, with a common boundary.
struct Neighbours {
  std::set<SpacePair> all;
  std::set<SpacePair> open;  // with an opening between them
};

SpacePair PairOf(const std::optional<SpaceId>& a,
                 const std::optional<SpaceId>& b) {
  return std::minmax(a ? a->value : kOutside, b ? b->value : kOutside);
}

Neighbours FindNeighbours(const Building& building) {
  Neighbours neighbours;
  for (const Opening& opening : building.info.openings) {
    const SpacePair pair = PairOf(opening.front_space, opening.back_space);
    neighbours.all.insert(pair);
    neighbours.open.insert(pair);
  }
  ForEachFace(*building.store, [&neighbours](FaceId, const Face& face) {
    neighbours.all.insert(PairOf(face.front_space, face.back_space));
  });
  return neighbours;
}

// The Spaces (or kOutside) of random points, by the cell that holds them.
using SpacesOfCells = std::map<uint32_t, std::set<uint32_t>>;

SpacesOfCells SampleSpaces(const Partition& told,
                           const PartitionLocator& truth,
                           const PartitionLocator& found) {
  SpacesOfCells spaces;
  Random random(1);
  for (int i = 0; i < 300000; ++i) {
    const Point3 p = RandomPointIn(truth.Box(), random);
    const auto space = told.cells[truth.Locate(p).Index()].space;
    spaces[found.Locate(p).value].insert(space ? space->value : kOutside);
  }
  return spaces;
}

TEST_P(GbxmlBuildings,
       CellsFoundUntoldJoinNoSpacesThatShareOnlyClosedSurfaces) {
  const Building building = Import(GetParam(), budget_);
  const Partition told = BuildPartition(*building.store, {}, budget_);
  const auto stripped = Stripped(building);
  const Partition found = BuildPartition(*stripped, {}, budget_);
  const PartitionLocator locator(*stripped);
  const SpacesOfCells spaces_of_cells =
      SampleSpaces(told, PartitionLocator(*building.store), locator);

  const Neighbours neighbours = FindNeighbours(building);
  size_t cells_in_spaces = 0;
  for (const auto& [cell, spaces] : spaces_of_cells) {
    cells_in_spaces += *spaces.begin() != kOutside ? 1U : 0U;
    for (auto a = spaces.begin(); a != spaces.end(); ++a) {
      for (auto b = std::next(a); b != spaces.end(); ++b) {
        EXPECT_TRUE(neighbours.open.count({*a, *b}) > 0 ||
                    neighbours.all.count({*a, *b}) == 0)
            << "cell " << cell << " joins spaces " << *a << " and " << *b;
      }
    }
  }
  EXPECT_GT(cells_in_spaces, 0U);
  // Leaves that look like one room are joined, and niches with a room.
  EXPECT_LT(found.cells.size(), locator.LeafCount());
}

INSTANTIATE_TEST_SUITE_P(Gbxml,
                         GbxmlBuildings,
                         ::testing::Values("gbxml/london.xml",
                                           "gbxml/bristol.xml",
                                           "gbxml/boston-utf16.xml",
                                           "gbxml/berlin2.xml.gz"));

TEST_P(Buildings, OpenBoundariesLieInPortalsAndAreaIsConserved) {
  const Building building = Import(GetParam(), budget_);
  const Partition partition = BuildPartition(*building.store, {}, budget_);
  double faces_m2 = 0;
  ForEachFace(*building.store, [&faces_m2](FaceId, const Face& face) {
    faces_m2 += PolygonArea(face.vertices);
  });
  double patches_m2 = partition.overlap_m2;
  for (const CellInfo& cell : partition.cells) {
    patches_m2 += cell.area_m2;
  }
  EXPECT_NEAR(patches_m2, 2 * faces_m2, 1e-6 * faces_m2);
  EXPECT_GT(testing::CheckBoundaries(*building.store, 500, 1), 100U);
}

INSTANTIATE_TEST_SUITE_P(All,
                         Buildings,
                         ::testing::Values("gbxml/london.xml",
                                           "gbxml/bristol.xml",
                                           "gbxml/boston-utf16.xml",
                                           "gbxml/berlin1.xml.gz",
                                           "gbxml/berlin2.xml.gz",
                                           "gbxml/columbia-broken-shells.xml"));

INSTANTIATE_TEST_SUITE_P(SlowObj,
                         Buildings,
                         ::testing::Values("obj/duplex.obj",
                                           "obj/townhouse.obj"));

}  // namespace
}  // namespace enfilade
