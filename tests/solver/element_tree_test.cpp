// Element trees in the store: what is saved is what is loaded.

#include "solver/element_tree.h"

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

// A tree of more than two stored pages, with all coefficients.
class StoredTree : public ::testing::Test {
 protected:
  StoredTree() : tree_(shape_, patches_) {
    Random random(7);
    while (tree_.Size() < 2 * CoefficientArray::kPageElements + 100) {
      ElementPath path = kRootPath;
      for (int level = 0; level < 6; ++level) {
        path = ChildPath(path, random.NextBelow(kChildren));
      }
      tree_.FindOrCreate(
          PatchId(random.NextBelow(static_cast<uint32_t>(patches_.size()))),
          path,
          patches_);
    }
    tree_.StartDelta();
    FillWithNoise(&tree_.Gathered(), 1);
    FillWithNoise(&tree_.Sent(), 2);
    FillWithNoise(&tree_.Delta(), 3);
    FillWithNoise(&tree_.Gain(), 4);
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
  MapStorage store_;
};

TEST_F(StoredTree, ComesBackWhole) {
  CellTree loaded = SavedAndLoaded();
  ASSERT_EQ(loaded.Size(), tree_.Size());
  EXPECT_EQ(loaded.Digest(), tree_.Digest());
  ExpectSame(loaded.Gathered(), tree_.Gathered());
  ExpectSame(loaded.Sent(), tree_.Sent());
  ExpectSame(loaded.Delta(), tree_.Delta());
  ExpectSame(loaded.Gain(), tree_.Gain());
  for (size_t i = 0; i < tree_.Size(); ++i) {
    EXPECT_EQ(loaded.Detail(ElementId(i)), tree_.Detail(ElementId(i)));
  }
}

TEST_F(StoredTree, WithoutDeltaComesBackWithoutIt) {
  tree_.ForgetDelta();
  CellTree loaded = SavedAndLoaded();
  EXPECT_FALSE(loaded.HasDelta());
  ExpectSame(loaded.Sent(), tree_.Sent());
  ExpectSame(loaded.Gain(), tree_.Gain());
}

TEST_F(StoredTree, SaysHowLargeItIsBeforeItIsLoaded) {
  EXPECT_EQ(CellTree::StoredSize(store_, kCell), 0U);
  CellTree loaded = SavedAndLoaded();
  EXPECT_EQ(CellTree::StoredSize(store_, kCell), tree_.Size());
  const uint64_t foreseen = CellTree::BytesFor(tree_.Size(), shape_);
  EXPECT_GE(loaded.SizeBytes(), foreseen);
  EXPECT_LT(loaded.SizeBytes(), foreseen + foreseen / 4);
}

TEST_F(StoredTree, ForReadingTakesWhatIsGatheredAlone) {
  tree_.Save(store_, kCell);
  const CellTree read =
      CellTree::LoadGathered(store_, kCell, shape_, patches_).value();
  EXPECT_EQ(read.Digest(), tree_.Digest());
  ExpectSame(read.Gathered(), tree_.Gathered());
  const uint64_t foreseen = CellTree::GatheredBytesFor(tree_.Size(), shape_);
  EXPECT_LT(read.SizeBytes(), foreseen + foreseen / 4);
  EXPECT_LT(2 * foreseen, CellTree::BytesFor(tree_.Size(), shape_));
}

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
