#include "solver/state/commit_clock.h"

#include <chrono>
#include <thread>

#include <gtest/gtest.h>

namespace enfilade {
namespace {

constexpr double kLong = 1000;  // s

TEST(CommitClock, WithoutTimeBetweenEveryStepIsCommitted) {
  CommitClock clock(0);
  EXPECT_TRUE(clock.IsDue());
  clock.Begin();
  std::this_thread::sleep_for(std::chrono::milliseconds(5));
  clock.End();
  EXPECT_TRUE(clock.IsDue());
}

TEST(CommitClock, WaitsAtLeastAsLongAsItIsTold) {
  CommitClock clock(kLong);
  EXPECT_FALSE(clock.IsDue());
  clock.Begin();
  clock.End();
  EXPECT_FALSE(clock.IsDue());
}

TEST(CommitClock, WaitsLongerAfterASlowCommit) {
  CommitClock clock(1e-9);
  std::this_thread::sleep_for(std::chrono::milliseconds(1));
  EXPECT_TRUE(clock.IsDue());
  clock.Begin();
  std::this_thread::sleep_for(std::chrono::milliseconds(500));
  clock.End();
  EXPECT_FALSE(clock.IsDue());  // for ten seconds
}

TEST(CommitClock, TheEndOfARoundDoesNotWait) {
  CommitClock clock(kLong);
  clock.MakeDue();
  EXPECT_TRUE(clock.IsDue());
  clock.Begin();
  clock.End();
  EXPECT_FALSE(clock.IsDue());
}

}  // namespace
}  // namespace enfilade
