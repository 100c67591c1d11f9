#include "solver/refine/source_weights.h"

#include "base/error.h"
#include "store/sqlite_store.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <vector>

#include "tests/solver/test_bulbs.h"
#include "tests/solver/test_cells.h"
#include "tests/visibility/test_rooms.h"
#include <gtest/gtest.h>

namespace enfilade {
namespace {

using test::GeometryOf;
using test::kFloatRounding;
using test::RandomPatches;

constexpr CellId kSourceCell(7U);
constexpr double kRoomM = 4;
constexpr double kPatchM = 0.5;

CellGeometry CellOf(const std::vector<Patch>& patches) {
  CellGeometry cell;
  cell.patches = GeometryOf(patches);
  cell.groups = SourceGroups(cell.patches);
  cell.clusters = std::make_unique<ClusterTree>(
      cell.patches, WholePatches(cell.patches.size()));
  return cell;
}

CellGeometry RandomCell(int patches) {
  return CellOf(
      RandomPatches(3, static_cast<size_t>(patches), kRoomM, kPatchM));
}

constexpr uint32_t kSides = 6;

// A room of six walls, of which a patch of a group is no part, and two bulbs.
CellGeometry RoomWithBulbs() {
  std::vector<Patch> patches = test::BoxPatches(test::kRoom, true);
  test::Append(patches, test::Bulb({1, 2, 2}, 0.05, 4));
  test::Append(patches, test::Bulb({3, 2, 2}, 0.03, 3));
  return CellOf(patches);
}

RefineSource SourceOf(const CellGeometry& cell) {
  return {.id = kSourceCell,
          .patches = cell.patches,
          .clusters = cell.clusters.get(),
          .groups = &cell.groups};
}

// A tree whose patches send more and more, each of them evenly.
CellTree TreeOf(const CellGeometry& cell) {
  CellTree tree({&SecondOrderBasis(), kRgbChannels}, cell.patches);
  for (size_t i = 0; i < tree.Size(); ++i) {
    for (float& b : tree.Sent()[ElementId(i)]) {
      b = static_cast<float>(i + 1);
    }
  }
  tree.UpdateDetail();
  return tree;
}

// Radiosity and flux of the patches that are in no group, exactly, as there is
// one product to round.
void ExpectLargestOfEachCluster(const CellGeometry& cell,
                                const SourceWeights& weights) {
  const auto clusters = cell.clusters->Clusters();
  ASSERT_EQ(weights.peaks.size(), clusters.size());
  ASSERT_EQ(weights.fluxes.size(), clusters.size());
  for (size_t c = 0; c < clusters.size(); ++c) {
    float peak = 0;
    float flux = 0;
    for (uint32_t k = 0; k < clusters[c].count; ++k) {
      const uint32_t patch =
          cell.clusters->Items()[clusters[c].first + k].patch;
      if (!cell.groups.Holds(patch)) {
        const auto sent = static_cast<float>(patch + 1);
        peak = std::max(peak, sent);
        flux = std::max(flux, sent * cell.patches[patch].area);
      }
    }
    EXPECT_EQ(weights.peaks[c], peak) << "cluster " << c;
    EXPECT_EQ(weights.fluxes[c], flux) << "cluster " << c;
  }
}

TEST(SourceWeights, AreTheLargestOfEachCluster) {
  const CellGeometry cell = RandomCell(40);
  const CellTree tree = TreeOf(cell);
  const SourceWeights weights = WeighSource(SourceOf(cell), tree);
  EXPECT_EQ(weights.peaks[0], 40);
  ExpectLargestOfEachCluster(cell, weights);
}

TEST(SourceWeights, OfClustersLeaveOutTheGroups) {
  const CellGeometry cell = RoomWithBulbs();
  ASSERT_EQ(cell.groups.Roots().size(), 2U);
  const CellTree tree = TreeOf(cell);
  const SourceWeights weights = WeighSource(SourceOf(cell), tree);
  EXPECT_EQ(weights.peaks[0], kSides);
  ExpectLargestOfEachCluster(cell, weights);
}

// Means over area of some dozens of patches, and the deviation from them: the
// mean square is rounded to parts of itself, of which the deviation's square is
// at least a thousandth.
TEST(SourceWeights, OfGroupsAreMeanAndDeviation) {
  const CellGeometry cell = RoomWithBulbs();
  const CellTree tree = TreeOf(cell);
  const SourceWeights weights = WeighSource(SourceOf(cell), tree);
  const auto groups = cell.groups.All();
  ASSERT_EQ(weights.groups.size(), groups.size());
  for (size_t g = 0; g < groups.size(); ++g) {
    double area = 0;
    double flux = 0;
    for (const uint32_t patch : cell.groups.PatchesOf(groups[g])) {
      area += static_cast<double>(cell.patches[patch].area);
      flux += static_cast<double>(cell.patches[patch].area) * (patch + 1);
    }
    const double mean = flux / area;
    double square = 0;
    for (const uint32_t patch : cell.groups.PatchesOf(groups[g])) {
      const double off = patch + 1 - mean;
      square += static_cast<double>(cell.patches[patch].area) * off * off;
    }
    const double spread = std::sqrt(square / area);
    EXPECT_NEAR(weights.groups[g].radiosity, mean, kFloatRounding * mean);
    EXPECT_NEAR(weights.groups[g].spread, spread, 1e-3 * spread);
  }
}

// The weights may be computed before a cell's elements are made, or after.
TEST(SourceWeights, AreTheSameOnceTheTreeHasGrown) {
  const CellGeometry cell = RandomCell(10);
  CellTree tree = TreeOf(cell);
  const SourceWeights before = WeighSource(SourceOf(cell), tree);
  for (uint32_t patch = 0; patch < 10; ++patch) {
    tree.FindOrCreate(
        PatchId(patch), ChildPath(ChildPath(kRootPath, 2), 1), cell.patches);
  }
  tree.UpdateDetail();
  const SourceWeights after = WeighSource(SourceOf(cell), tree);
  EXPECT_EQ(before.peaks, after.peaks);
  EXPECT_EQ(before.fluxes, after.fluxes);
}

TEST(SourceWeights, ComeBackFromTheStore) {
  const CellGeometry cell = RoomWithBulbs();
  const CellTree tree = TreeOf(cell);
  const SourceWeights weights = WeighSource(SourceOf(cell), tree);
  const auto store = CreateStoreInMemory();
  EXPECT_FALSE(HasSourceWeights(*store, kSourceCell));
  SaveSourceWeights(*store, kSourceCell, weights);
  ASSERT_TRUE(HasSourceWeights(*store, kSourceCell));
  const SourceWeights read = LoadSourceWeights(*store, kSourceCell, cell);
  EXPECT_EQ(read.peaks, weights.peaks);
  EXPECT_EQ(read.fluxes, weights.fluxes);
  ASSERT_FALSE(weights.groups.empty());
  ASSERT_EQ(read.groups.size(), weights.groups.size());
  for (size_t g = 0; g < read.groups.size(); ++g) {
    EXPECT_EQ(read.groups[g].radiosity, weights.groups[g].radiosity);
    EXPECT_EQ(read.groups[g].spread, weights.groups[g].spread);
  }
  EraseSourceWeights(*store, kSourceCell);
  EXPECT_FALSE(HasSourceWeights(*store, kSourceCell));
}

TEST(SourceWeights, OfAnotherCellAreRefused) {
  const CellGeometry cell = RandomCell(40);
  const CellTree tree = TreeOf(cell);
  const auto store = CreateStoreInMemory();
  SaveSourceWeights(*store, kSourceCell, WeighSource(SourceOf(cell), tree));
  EXPECT_THROW(LoadSourceWeights(*store, kSourceCell, RandomCell(90)),
               DamagedStoreError);
}

}  // namespace
}  // namespace enfilade
