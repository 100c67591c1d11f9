#include "tools/progress.h"

#include <chrono>
#include <string>
#include <thread>

#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

namespace enfilade {
namespace {

TEST(FormatDuration, UsesTheTwoLargestUnits) {
  EXPECT_EQ(FormatDuration(0), "0 s");
  EXPECT_EQ(FormatDuration(59.4), "59 s");
  EXPECT_EQ(FormatDuration(59.6), "1 min 00 s");
  EXPECT_EQ(FormatDuration(200), "3 min 20 s");
  EXPECT_EQ(FormatDuration(7500), "2 h 05 min");
}

TEST(ProgressText, ExtrapolatesTheTimeLeft) {
  EXPECT_EQ(ProgressText("solve", {0, 0.25, 30}, ""),
            "solve 25 %, 1 min 30 s left");
}

TEST(ProgressText, GivesNoTimeBeforeItKnowsEnough) {
  EXPECT_EQ(ProgressText("solve", {0, 0.01, 30}, "refine"),
            "solve 1 %: refine");
}

// The work of an earlier run took none of this run's time.
TEST(ProgressText, OfARunThatGoesOnExtrapolatesFromWhereItBegan) {
  EXPECT_EQ(ProgressText("solve", {0.6, 0.7, 30}, ""),
            "solve 70 %, 1 min 30 s left");
  EXPECT_EQ(ProgressText("solve", {0.6, 0.61, 30}, "refine"),
            "solve 61 %: refine");
}

TEST(ProgressText, SaysHundredPercentOnlyWhenDone) {
  EXPECT_EQ(ProgressText("solve", {0, 0.999, 999}, ""), "solve 99 %, 1 s left");
  EXPECT_EQ(ProgressText("solve", {0, 1, 1000}, ""), "solve 100 %");
}

TEST(ProgressText, ClampsTheFraction) {
  EXPECT_EQ(ProgressText("solve", {0, 1.5, 10}, ""), "solve 100 %");
  EXPECT_EQ(ProgressText("solve", {0, -1, 10}, ""), "solve 0 %");
}

// What another part has taken says nothing of this one.
TEST(Progress, ExtrapolatesEachPartByItself) {
  ::testing::internal::CaptureStderr();
  Progress progress(Progress::Output::kTerminal);
  progress.Begin("solve");
  // Lines begin after a second.
  std::this_thread::sleep_for(std::chrono::milliseconds(1100));
  progress.UpdatePart("round 1 refine", 0.5, "");
  progress.UpdatePart("round 1 residual", 0, "");
  std::this_thread::sleep_for(std::chrono::milliseconds(250));
  progress.UpdatePart("round 1 residual", 0.5, "error 0.3");
  const std::string shown = ::testing::internal::GetCapturedStderr();
  EXPECT_NE(shown.find("solve round 1 refine 50 %"), std::string::npos);
  EXPECT_NE(shown.find("solve round 1 residual 50 %, 0 s left: error 0.3"),
            std::string::npos)
      << shown;
}

// Nothing can be written to the terminal any more, as after a logout.
TEST(Progress, GoesOnWithoutItsTerminal) {
  const int stderr_before = dup(STDERR_FILENO);
  const int full = open("/dev/full", O_WRONLY | O_CLOEXEC);
  ASSERT_GE(full, 0);
  dup2(full, STDERR_FILENO);
  {
    Progress progress(Progress::Output::kTerminal);
    progress.Begin("solve");
    // Lines begin after a second.
    std::this_thread::sleep_for(std::chrono::milliseconds(1100));
    EXPECT_NO_THROW(progress.Update(0.5));
    EXPECT_NO_THROW(progress.End());
  }
  dup2(stderr_before, STDERR_FILENO);
  close(stderr_before);
  close(full);
}

}  // namespace
}  // namespace enfilade
