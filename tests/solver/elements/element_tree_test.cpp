// Element trees and the light they receive, in the store: a load returns what
// was saved.

#include "solver/elements/element_tree.h"

#include "base/error.h"
#include "solver/elements/cell_delta.h"
#include "solver/elements/received_light.h"

#include <algorithm>

#include "tests/solver/test_cells.h"
#include "tests/visibility/map_storage.h"
#include <gtest/gtest.h>

namespace enfilade {
namespace {

using test::GeometryOf;
using test::MapStorage;
using test::RandomPatches;

constexpr CellId kCell(3U);

void FillWithNoise(CoefficientArray* array, uint64_t seed) {
  Random random(seed);
  for (size_t page = 0; page < array->PageCount(); ++page) {
    for (float& v : array->Page(page)) {
      v = static_cast<float>(random.Next());
    }
  }
}

void ExpectSame(const CoefficientArray& a, const CoefficientArray& b) {
  ASSERT_EQ(a.Size(), b.Size());
  for (size_t page = 0; page < a.PageCount(); ++page) {
    EXPECT_TRUE(std::ranges::equal(a.Page(page), b.Page(page)));
  }
}

// A tree of more than one stored page of its structure and many of its
// coefficients.
class StoredTree : public ::testing::Test {
 protected:
  StoredTree() : tree_(shape_, patches_), received_(shape_) {
    Random random(7);
    while (tree_.Size() <
           kChildren * (PagedVector<uint32_t>::kPageItems + 100)) {
      ElementPath path = kRootPath;
      for (int level = 0; level < 6; ++level) {
        path = ChildPath(path, random.NextBelow(kChildren));
      }
      tree_.FindOrCreate(
          PatchId(random.NextBelow(static_cast<uint32_t>(patches_.size()))),
          path,
          patches_);
    }
    FillWithNoise(&tree_.Sent(), 2);
    received_.GrowTo(tree_.Size());
    FillWithNoise(&received_.gathered, 1);
    FillWithNoise(&received_.gain, 4);
    tree_.UpdateDetail();
  }

  [[nodiscard]] CellTree SavedAndLoaded() {
    tree_.Save(store_, kCell);
    return CellTree::Load(store_, kCell, shape_, patches_).value();
  }

  std::vector<PatchGeometry> patches_ =
      GeometryOf(RandomPatches(41, 40, 4, 2), 0.8);
  Basis basis_{2};
  TreeShape shape_{&basis_, kRgbChannels};
  CellTree tree_;
  ReceivedLight received_;
  MapStorage store_;
};

TEST_F(StoredTree, ComesBackWhole) {
  CellTree loaded = SavedAndLoaded();
  EXPECT_TRUE(loaded.IsValid());
  ASSERT_EQ(loaded.Size(), tree_.Size());
  EXPECT_EQ(loaded.Digest(received_.gathered),
            tree_.Digest(received_.gathered));
  ExpectSame(loaded.Sent(), tree_.Sent());
  for (size_t i = 0; i < tree_.Size(); ++i) {
    EXPECT_EQ(loaded.Detail(ElementId(i)), tree_.Detail(ElementId(i)));
  }
}

TEST_F(StoredTree, SaysHowLargeItIsBeforeItIsLoaded) {
  EXPECT_EQ(CellTree::StoredSize(store_, kCell), 0U);
  CellTree loaded = SavedAndLoaded();
  EXPECT_EQ(CellTree::StoredSize(store_, kCell), tree_.Size());
  const uint64_t foreseen = CellTree::BytesFor(tree_.Size(), shape_);
  EXPECT_GE(loaded.SizeBytes(), foreseen);
  EXPECT_LT(loaded.SizeBytes(), foreseen + foreseen / 4);
}

TEST_F(StoredTree, ForReadingComesWithoutCoefficients) {
  tree_.Save(store_, kCell);
  const CellTree read =
      CellTree::LoadElements(store_, kCell, shape_, patches_).value();
  EXPECT_EQ(read.Digest(received_.gathered), tree_.Digest(received_.gathered));
  const uint64_t foreseen = CellTree::ElementBytesFor(tree_.Size());
  EXPECT_LT(read.SizeBytes(), foreseen + foreseen / 4);
  EXPECT_LT(3 * foreseen, CellTree::BytesFor(tree_.Size(), shape_));
}

TEST_F(StoredTree, HasADeltaBeside) {
  tree_.Save(store_, kCell);
  EXPECT_EQ(LoadDelta(store_, kCell, shape_, tree_.Size()).Size(), 0U);

  CoefficientArray delta(shape_.Stride());
  delta.GrowTo(tree_.Size());
  FillWithNoise(&delta, 3);
  SaveDelta(store_, kCell, delta);
  ExpectSame(LoadDelta(store_, kCell, shape_, tree_.Size()), delta);
  EXPECT_THROW(LoadDelta(store_, kCell, shape_, tree_.Size() - 1),
               DamagedStoreError);

  delta.SetZero();
  SaveDelta(store_, kCell, delta);
  EXPECT_EQ(store_.Count(BlockKind::kCellDelta), 0U);
}

// Elements that are made while the delta is not in memory get the same part of
// it as if it had been in memory: the part of their ancestor.
TEST_F(StoredTree, LetsItsDeltaGrowToElementsMadeSince) {
  CoefficientArray delta(shape_.Stride());
  delta.GrowTo(tree_.Size());
  FillWithNoise(&delta, 3);
  std::vector<ElementId> deepest;
  for (size_t p = 0; p < patches_.size(); ++p) {
    ElementPath to = kRootPath;
    ElementId leaf(p);
    while (tree_.At(leaf).first_child != 0) {
      leaf = ElementId(tree_.At(leaf).first_child + 3);
      to = ChildPath(to, 3);
    }
    const ElementId child =
        tree_.FindOrCreate(PatchId(p), ChildPath(to, 2), patches_);
    tree_.FindOrCreate(PatchId(p), ChildPath(ChildPath(to, 2), 1), patches_);
    ASSERT_GE(child.Index(), delta.Size());
    deepest.push_back(leaf);
  }
  const CoefficientArray before = delta;
  GrowDelta(tree_, &delta);
  ASSERT_EQ(delta.Size(), tree_.Size());
  for (size_t i = 0; i < before.Size(); ++i) {
    EXPECT_TRUE(std::ranges::equal(delta[ElementId(i)], before[ElementId(i)]));
  }
  for (const ElementId leaf : deepest) {
    std::vector<float> expected(shape_.Stride());  // triangles leave some zero
    const Element& e = tree_.At(leaf);
    const ShapeBasis& basis = basis_.On(patches_[e.patch].shape);
    const ElementId child(e.first_child + 2);
    PushTo(basis, shape_, 2, before[leaf], expected);
    EXPECT_TRUE(std::ranges::equal(delta[child], expected));
    PushTo(basis, shape_, 1, delta[child], expected);
    EXPECT_TRUE(std::ranges::equal(
        delta[ElementId(tree_.At(child).first_child + 1)], expected));
  }
}

// The tree's structure is stored in pages: a load throws if a page is missing
// or of an earlier state.
TEST_F(StoredTree, LacksNoElements) {
  tree_.Save(store_, kCell);
  const BlockKey first{BlockKind::kCellTree, kCell.value, 0, 1};
  const BlockKey second{BlockKind::kCellTree, kCell.value, 0, 2};
  store_.Put(second, store_.GetOrThrow(first));
  EXPECT_THROW(CellTree::LoadElements(store_, kCell, shape_, patches_),
               DamagedStoreError);
  store_.Erase(second);
  EXPECT_THROW(CellTree::LoadElements(store_, kCell, shape_, patches_),
               DamagedStoreError);
}

TEST_F(StoredTree, LacksNoCoefficients) {
  tree_.Save(store_, kCell);
  store_.Erase({BlockKind::kCellTree, kCell.value, 1, 0});
  EXPECT_THROW(CellTree::Load(store_, kCell, shape_, patches_),
               DamagedStoreError);
}

// ------------------------------------------------------------ received light

TEST_F(StoredTree, WhatItReceivedComesBackWhole) {
  received_.Save(store_, kCell);
  const auto loaded = ReceivedLight::Load(store_, kCell, shape_, tree_.Size());
  ExpectSame(loaded.gathered, received_.gathered);
  ExpectSame(loaded.gain, received_.gain);
  EXPECT_GE(loaded.SizeBytes(), ReceivedLight::BytesFor(tree_.Size(), shape_));
  ExpectSame(ReceivedLight::LoadGathered(store_, kCell, shape_, tree_.Size()),
             received_.gathered);
}

// Elements that were added after the save have received nothing.
TEST_F(StoredTree, ElementsThatWereAddedHaveReceivedNothing) {
  for (const size_t more : {size_t{1}, CoefficientArray::kPageElements + 7}) {
    received_.Save(store_, kCell);
    const auto loaded = ReceivedLight::Load(
        store_, kCell, shape_, received_.gain.Size() + more);
    received_.GrowTo(received_.gain.Size() + more);
    ExpectSame(loaded.gathered, received_.gathered);
    ExpectSame(loaded.gain, received_.gain);
  }
}

TEST_F(StoredTree, HasReceivedNothingYet) {
  auto loaded = ReceivedLight::Load(store_, kCell, shape_, 5000);
  EXPECT_EQ(loaded.gathered.Size(), 5000U);
  EXPECT_EQ(loaded.gathered.MaxAbs(), 0);
  EXPECT_EQ(loaded.gain.Size(), 5000U);
  EXPECT_EQ(loaded.gain.MaxAbs(), 0);
}

TEST_F(StoredTree, DamagedReceivedLightIsNoticed) {
  received_.Save(store_, kCell);
  EXPECT_THROW(ReceivedLight::Load(store_, kCell, shape_, tree_.Size() - 1),
               DamagedStoreError);
  store_.Erase({BlockKind::kReceived, kCell.value, 0, 1});
  EXPECT_THROW(ReceivedLight::Load(store_, kCell, shape_, tree_.Size()),
               DamagedStoreError);
}

// ------------------------------------------------------------------- arrays

TEST(CoefficientArray, ClearedItTakesNothing) {
  CoefficientArray array(12);
  array.GrowTo(5000);
  EXPECT_GT(array.SizeBytes(), 0U);
  array.Clear();
  EXPECT_EQ(array.SizeBytes(), 0U);
  EXPECT_EQ(array.Size(), 0U);
  array.GrowTo(1);
  EXPECT_EQ(array.MaxAbs(), 0);
}

}  // namespace
}  // namespace enfilade
