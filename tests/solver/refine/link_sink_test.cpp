// Where links go while a part of the work is refined: their limits, their
// errors, and the rays of weak links.

#include "solver/refine/link_sink.h"

#include <atomic>
#include <cstddef>
#include <cstdint>

#include "tests/solver/test_refinement.h"
#include "tests/visibility/test_rooms.h"
#include <gtest/gtest.h>

namespace enfilade {
namespace {

using test::Scenery;

// A ray upwards through the middle of a square at a height of 1 m.
constexpr PointPair kUpwards = {{0.5F, 0.5F, 0}, {0.5F, 0.5F, 2}};

// A weak link of coefficient 0.25 and error 3 W/m.
PendingLink Pending() {
  return {{}, 0.25F, 3};
}

class LinkSinkTest : public ::testing::Test {
 protected:
  const Scenery nothing_ = Scenery({});
  const Scenery square_ = Scenery({test::Ceiling(1)});
  RawLinks out_;
};

TEST_F(LinkSinkTest, OverflowsBeyondTheLimitOfItsPart) {
  LinkSink sink(nothing_.All(), {.most = 2}, &out_);
  sink.Add({});
  sink.Add({});
  EXPECT_FALSE(sink.Overflowed());
  sink.Add({});
  EXPECT_TRUE(sink.Overflowed());
}

TEST_F(LinkSinkTest, OverflowsBeyondTheLimitOfAllParts) {
  std::atomic<size_t> together = 8;
  LinkSink sink(
      nothing_.All(), {.together = &together, .most_together = 9}, &out_);
  sink.Add({});
  EXPECT_FALSE(sink.Overflowed());
  sink.Add({});
  EXPECT_TRUE(sink.Overflowed());
  EXPECT_EQ(together, 10U);
}

TEST_F(LinkSinkTest, NumbersShapesFromZero) {
  LinkSink sink(nothing_.All(), {}, &out_);
  EXPECT_EQ(sink.AddShape({1}), 0U);
  EXPECT_EQ(sink.AddShape({2}), 1U);
  EXPECT_EQ(out_.shapes[1][0], 2);
}

TEST_F(LinkSinkTest, WeakLinksWaitUntilTheirPacketIsFull) {
  LinkSink sink(nothing_.All(), {}, &out_);
  for (int i = 0; i < 15; ++i) {
    sink.AddPending(Pending(), kUpwards);
  }
  sink.TakeBlocked();  // there are no blocked errors
  EXPECT_TRUE(out_.links.empty());
  sink.AddPending(Pending(), kUpwards);
  ASSERT_EQ(out_.links.size(), 16U);
  EXPECT_EQ(out_.links[15].gain[0], 0.25F);
  EXPECT_EQ(DecodeCoefficient(out_.links[15].value), 0.25F);
  EXPECT_EQ(out_.squared_error, 16 * 9);
}

TEST_F(LinkSinkTest, TracesTheLastWeakLinksWhenItIsFinished) {
  LinkSink sink(nothing_.All(), {}, &out_);
  sink.AddPending(Pending(), kUpwards);
  sink.Finish();
  EXPECT_EQ(out_.links.size(), 1U);
  EXPECT_EQ(out_.rays, 1U);
}

TEST_F(LinkSinkTest, DropsWeakLinksWhoseRaysAreBlocked) {
  LinkSink sink(square_.All(), {}, &out_);
  sink.AddPending(Pending(), kUpwards);
  sink.Finish();
  EXPECT_TRUE(out_.links.empty());
  EXPECT_EQ(out_.squared_error, 0);
  EXPECT_EQ(out_.rays, 1U);
}

TEST_F(LinkSinkTest, BlockedErrorsCountByTheRaysThatGetThrough) {
  LinkSink sink(nothing_.All(), {}, &out_);
  *sink.Rays() = {.traced = 96, .seen = 0};
  sink.AddError(10, false);
  EXPECT_EQ(out_.squared_error, 0);
  sink.TakeBlocked();
  EXPECT_NEAR(out_.squared_error, 100 * 0.02, 1e-12);
  // All rays since then got through: errors count once at most.
  *sink.Rays() = {.traced = 192, .seen = 96};
  sink.AddError(10, false);
  sink.TakeBlocked();
  EXPECT_NEAR(out_.squared_error, 102, 1e-12);
  sink.TakeBlocked();
  EXPECT_NEAR(out_.squared_error, 102, 1e-12);
}

TEST_F(LinkSinkTest, RaysThatWaitCountForBlockedErrors) {
  LinkSink sink(square_.All(), {}, &out_);
  sink.AddPending(Pending(), kUpwards);
  sink.AddError(10, false);
  sink.TakeBlocked();
  EXPECT_NEAR(out_.squared_error, 100 * 2.0 / 5, 1e-12);
}

}  // namespace
}  // namespace enfilade
