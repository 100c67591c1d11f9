// What errors on a receiver count, and which elements may see each other.

#include "solver/refine/pair_context.h"

#include "tests/solver/test_refinement.h"
#include "tests/visibility/test_rooms.h"
#include <gtest/gtest.h>

namespace enfilade {
namespace {

using test::BrightCell;
using test::Scenery;

// A floor that reflects a half, and a ceiling above it.
class FloorAndCeiling : public ::testing::Test {
 protected:
  [[nodiscard]] PairContext Context(const RefineOptions& options) const {
    return {PairWork(options, receiver_, source_), *source_.tree, none_.All()};
  }

  const Basis basis_ = Basis(2);
  const BrightCell floor_ = BrightCell(0, basis_, {test::Floor()});
  const BrightCell ceiling_ = BrightCell(1, basis_, {test::Ceiling(1)});
  const Scenery none_ = Scenery({});
  RefineReceiver receiver_ = floor_.Receiver();
  test::SourceAndTree source_ = ceiling_.Source();
};

TEST_F(FloorAndCeiling, ErrorsCountWithoutTheCareOfTheReceiver) {
  const PairContext pair = Context({});
  ReceiverElement r = RootReceiver(receiver_, {0, kRootPath});
  EXPECT_EQ(pair.TrueError(r, 3), 3);
  r.care = 2;
  EXPECT_EQ(pair.TrueError(r, 3), 1.5F);
}

TEST_F(FloorAndCeiling, ErrorsOnDarkSurfacesCountByWhatTheyReflect) {
  receiver_.least_reflectance = 1;
  const ReceiverElement r = RootReceiver(receiver_, {0, kRootPath});
  EXPECT_EQ(r.weight, 1);
  EXPECT_EQ(Context({}).TrueError(r, 3), 1.5F);
  EXPECT_EQ(Context({.counts_black = true}).TrueError(r, 3), 3);
}

TEST_F(FloorAndCeiling, SeeEachOtherInTheirPartsOnly) {
  const ReceiverElement r = RootReceiver(receiver_, {0, kRootPath});
  const PairContext whole = Context({});
  const SourceElement s = whole.sources.OfPatch(0);
  EXPECT_TRUE(whole.MaySee(r.end, s.end));
  receiver_.part = {{-1, -1, -1}, {0.4F, 2, 1}};
  const PairContext part = Context({});
  EXPECT_TRUE(part.MaySee(r.end, s.end));
  int seen = 0;
  for (size_t c = 0; c < kChildren; ++c) {
    seen += part.MaySee(ChildReceiver(r, c).end, s.end) ? 1 : 0;
  }
  EXPECT_EQ(seen, 2);
}

}  // namespace
}  // namespace enfilade
