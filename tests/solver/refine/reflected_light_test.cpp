// The light that elements reflect is known down to where it was balanced, and
// no further, however the tree has grown since.

#include "solver/refine/reflected_light.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "tests/solver/test_cells.h"
#include "tests/visibility/test_rooms.h"
#include <gtest/gtest.h>

namespace enfilade {
namespace {

// One square, whose quarters send 1, 2, 3 and 6 W/m2.
class LitSquare : public ::testing::Test {
 protected:
  LitSquare() {
    tree_.FindOrCreate(PatchId(0U), ChildPath(kRootPath, 0), geometry_);
    Fill(ElementId(0U), 3);
    const float sent[] = {1, 2, 3, 6};
    for (size_t c = 0; c < kChildren; ++c) {
      Fill(ElementId(tree_.At(ElementId(0U)).first_child + c), sent[c]);
    }
    tree_.UpdateDetail();
  }

  void Fill(ElementId element, float value) {
    auto sent = tree_.Sent()[element];
    std::fill(sent.begin(), sent.end(), value);
  }

  const Basis basis_{2};
  const std::vector<PatchGeometry> geometry_ =
      test::GeometryOf({test::Rectangle({0, 0, 0}, {1, 0, 0}, {0, 1, 0})});
  const SurfaceTable surfaces_;  // not asked: nothing emits
  CellTree tree_{{&basis_, kRgbChannels}, geometry_};
};

TEST_F(LitSquare, IsKnownAsFarAsItWasBalanced) {
  const ReflectedLight light(tree_, geometry_, surfaces_, {});
  const ReflectedElement whole = light.OfPatch(0);
  EXPECT_FLOAT_EQ(whole.mean, 3);
  EXPECT_FLOAT_EQ(whole.detail, std::sqrt((4 + 1 + 0 + 9) / 4.0F));
  const ReflectedElement quarter = light.OfChild(whole, 3);
  EXPECT_FLOAT_EQ(quarter.mean, 6);
  EXPECT_EQ(quarter.detail, 0);
  EXPECT_FLOAT_EQ(light.OfChild(quarter, 0).mean, 6);
}

TEST_F(LitSquare, IsTheSameWhenTheTreeHasGrown) {
  const ElementPath quarter = ChildPath(kRootPath, 3);
  tree_.FindOrCreate(PatchId(0U), ChildPath(quarter, 0), geometry_);
  const ReflectedLight light(tree_, geometry_, surfaces_, {});
  const ReflectedElement at = light.OfChild(light.OfPatch(0), 3);
  EXPECT_EQ(light.OfChild(at, 0).element, at.element);
}

TEST_F(LitSquare, CountsByTheCareOfItsPatch) {
  std::vector<PatchCare> care(1);
  care[0].care = 2;
  const ReflectedElement whole =
      ReflectedLight(tree_, geometry_, surfaces_, care).OfPatch(0);
  EXPECT_FLOAT_EQ(whole.mean, 6);
  EXPECT_FLOAT_EQ(whole.detail, 2 * std::sqrt((4 + 1 + 0 + 9) / 4.0F));
}

}  // namespace
}  // namespace enfilade
