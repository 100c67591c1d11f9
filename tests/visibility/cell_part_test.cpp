#include "visibility/cell_part.h"

#include "base/random.h"

#include <cmath>

#include <gtest/gtest.h>

namespace enfilade {
namespace {

const Box3 kBounds = {{-3, 10, 0}, {7, 110, 2.55}};

TEST(CellPart, HoldsItsBoxAndLittleMore) {
  Random random(5);
  for (int i = 0; i < 1000; ++i) {
    Box3 box;
    for (int k = 0; k < 2; ++k) {
      box.Include(Point3{-3 + 10 * random.Next(),
                         10 + 100 * random.Next(),
                         2.55 * random.Next()});
    }
    const Box3 back = BoxOf(kBounds, PartOf(kBounds, box));
    for (size_t axis = 0; axis < 3; ++axis) {
      const double step = kBounds.Extent()[axis] / 255 + 1.1e-3;
      EXPECT_LT(back.low[axis], box.low[axis]);
      EXPECT_GT(back.high[axis], box.high[axis]);
      EXPECT_TRUE(std::isinf(back.low[axis]) ||
                  back.low[axis] > box.low[axis] - step);
      EXPECT_TRUE(std::isinf(back.high[axis]) ||
                  back.high[axis] < box.high[axis] + step);
    }
  }
}

// A luminaire may hang a little out of its cell.
TEST(CellPart, HasNoEndWhereItReachesTheBounds) {
  const Box3 part = BoxOf(kBounds, PartOf(kBounds, {{-3, 20, 1}, {0, 110, 2}}));
  EXPECT_TRUE(std::isinf(part.low.x));
  EXPECT_TRUE(std::isinf(part.high.y));
  EXPECT_FALSE(std::isinf(part.high.x) || std::isinf(part.low.y) ||
               std::isinf(part.low.z) || std::isinf(part.high.z));
}

TEST(CellPart, OfAFlatCellIsAllOfIt) {
  const Box3 flat = {{0, 0, 1}, {5, 5, 1}};
  EXPECT_TRUE(BoxOf(flat, PartOf(flat, flat)).Contains({2, 2, 1}));
  EXPECT_EQ(PartOf(flat, flat), CellPart{});
}

}  // namespace
}  // namespace enfilade
