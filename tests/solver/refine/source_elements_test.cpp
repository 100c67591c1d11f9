// Sources have the radiosity of their tree as far as it is known, and are the
// same below that whether or not the tree has grown.

#include "solver/refine/source_elements.h"

#include <cstddef>
#include <vector>

#include "tests/solver/test_refinement.h"
#include "tests/visibility/test_rooms.h"
#include <gtest/gtest.h>

namespace enfilade {
namespace {

using test::BrightCell;

const ElementId kPatch(size_t{0});

// A square that sends 1 W/m2 as a whole. With detail, its quarters send 2, 3, 4
// and 5 W/m2.
class SourceSquare : public ::testing::Test {
 protected:
  void Split() {
    cell_.Tree().FindOrCreate(
        PatchId(size_t{0}), ChildPath(kRootPath, 0), cell_.Geometry());
  }

  void AddDetail() {
    Split();
    for (size_t c = 0; c < kChildren; ++c) {
      const ElementId child(cell_.Tree().At(kPatch).first_child + c);
      for (float& b : cell_.Tree().Sent()[child]) {
        b = 2.0F + static_cast<float>(c);
      }
    }
    cell_.Tree().UpdateDetail();
  }

  [[nodiscard]] SourceElements Elements() {
    return {cell_.Geometry(), cell_.Tree()};
  }

  const Basis basis_ = Basis(2);
  BrightCell cell_ = BrightCell(0, basis_, {test::Floor()});
};

TEST_F(SourceSquare, HasTheRadiosityOfItsChildrenWhereThereIsDetail) {
  AddDetail();
  const SourceElement patch = Elements().OfPatch(0);
  EXPECT_GT(patch.detail, 0);
  for (size_t c = 0; c < kChildren; ++c) {
    const SourceElement child = Elements().OfChild(patch, c);
    EXPECT_FLOAT_EQ(PeakOf(child), 2.0F + static_cast<float>(c));
    EXPECT_EQ(child.path, ChildPath(kRootPath, c));
    EXPECT_FLOAT_EQ(child.end.area, 0.25F);
  }
}

TEST_F(SourceSquare, IsTheSameBelowItsDetailWhetherItHasGrownOrNot) {
  const SourceElement patch = Elements().OfPatch(0);
  const SourceElement before = Elements().OfChild(patch, 1);
  Split();
  const SourceElement after = Elements().OfChild(Elements().OfPatch(0), 1);
  EXPECT_EQ(before.element, kPatch);
  EXPECT_EQ(after.element, kPatch);
  EXPECT_EQ(before.radiosity, after.radiosity);
  EXPECT_NEAR(static_cast<double>(PeakOf(before)), 1, test::kFloatRounding);
}

TEST_F(SourceSquare, HasNoConcentratedDetailWithoutDetail) {
  const std::vector<PatchGeometry> above =
      test::GeometryOf({test::Ceiling(0.1)});
  const TransferEnd receiver = MakeTransferEnd(above[0], {});
  EXPECT_EQ(Elements().NearestError(Elements().OfPatch(0), receiver, 1), 0);
  AddDetail();
  EXPECT_GT(Elements().NearestError(Elements().OfPatch(0), receiver, 1), 0);
}

}  // namespace
}  // namespace enfilade
