#include "solver/refine/source_weights.h"

#include "base/error.h"
#include "store/sqlite_store.h"

#include <algorithm>
#include <memory>
#include <vector>

#include "tests/solver/test_cells.h"
#include <gtest/gtest.h>

namespace enfilade {
namespace {

using test::GeometryOf;
using test::RandomPatches;

constexpr CellId kCell(7U);
constexpr double kRoomM = 4;
constexpr double kPatchM = 0.5;

CellGeometry RandomCell(int patches) {
  CellGeometry cell;
  cell.patches = GeometryOf(
      RandomPatches(3, static_cast<size_t>(patches), kRoomM, kPatchM));
  cell.clusters = std::make_unique<ClusterTree>(
      cell.patches, WholePatches(cell.patches.size()));
  return cell;
}

RefineSide SideOf(const CellGeometry& cell, const CellTree& tree) {
  return {.id = kCell,
          .patches = cell.patches,
          .tree = &tree,
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

TEST(SourceWeights, AreTheLargestOfEachCluster) {
  const CellGeometry cell = RandomCell(40);
  const CellTree tree = TreeOf(cell);
  const SourceWeights weights = WeighSource(SideOf(cell, tree));
  EXPECT_EQ(weights.peaks[0], 40);
  const auto clusters = cell.clusters->Clusters();
  ASSERT_EQ(weights.peaks.size(), clusters.size());
  for (size_t c = 0; c < clusters.size(); ++c) {
    float largest = 0;
    for (uint32_t k = 0; k < clusters[c].count; ++k) {
      const ClusterItem& item = cell.clusters->Items()[clusters[c].first + k];
      largest = std::max(largest, static_cast<float>(item.patch + 1));
    }
    EXPECT_EQ(weights.peaks[c], largest);
  }
}

// The weights may be computed before a cell's elements are made, or after.
TEST(SourceWeights, AreTheSameOnceTheTreeHasGrown) {
  const CellGeometry cell = RandomCell(10);
  CellTree tree = TreeOf(cell);
  const SourceWeights before = WeighSource(SideOf(cell, tree));
  for (uint32_t patch = 0; patch < 10; ++patch) {
    tree.FindOrCreate(
        PatchId(patch), ChildPath(ChildPath(kRootPath, 2), 1), cell.patches);
  }
  tree.UpdateDetail();
  const SourceWeights after = WeighSource(SideOf(cell, tree));
  EXPECT_EQ(before.peaks, after.peaks);
  EXPECT_EQ(before.fluxes, after.fluxes);
}

TEST(SourceWeights, ComeBackFromTheStore) {
  const CellGeometry cell = RandomCell(40);
  const CellTree tree = TreeOf(cell);
  const SourceWeights weights = WeighSource(SideOf(cell, tree));
  const auto store = CreateStoreInMemory();
  EXPECT_FALSE(HasSourceWeights(*store, kCell));
  SaveSourceWeights(*store, kCell, weights);
  ASSERT_TRUE(HasSourceWeights(*store, kCell));
  const SourceWeights read = LoadSourceWeights(*store, kCell, cell);
  EXPECT_EQ(read.peaks, weights.peaks);
  EXPECT_EQ(read.fluxes, weights.fluxes);
  EraseSourceWeights(*store, kCell);
  EXPECT_FALSE(HasSourceWeights(*store, kCell));
}

TEST(SourceWeights, OfAnotherCellAreRefused) {
  const CellGeometry cell = RandomCell(40);
  const CellTree tree = TreeOf(cell);
  const auto store = CreateStoreInMemory();
  SaveSourceWeights(*store, kCell, WeighSource(SideOf(cell, tree)));
  EXPECT_THROW(LoadSourceWeights(*store, kCell, RandomCell(90)),
               DamagedStoreError);
}

}  // namespace
}  // namespace enfilade
