// The first signal asks the process to stop, signals at the same time ask for
// the same, and a later one ends the process.

#include "tools/signal.h"

#include "base/stop.h"

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <thread>

#include <gtest/gtest.h>

namespace enfilade {
namespace {

constexpr int kStopped = 7;
constexpr int kNotAsked = 8;

// What the process does once it has heeded the request.
[[noreturn]] void EndOrderly() {
  std::_Exit(StopRequested() ? kStopped : kNotAsked);
}

// Each test runs in a process of its own, whose flag is not set.
class SignalTest : public ::testing::Test {
 protected:
  SignalTest() { GTEST_FLAG_SET(death_test_style, "threadsafe"); }
};

TEST_F(SignalTest, NoneIsNoRequest) {
  const auto run = [] {
    InstallStopHandlers();
    EndOrderly();
  };
  EXPECT_EXIT(run(), ::testing::ExitedWithCode(kNotAsked), "");
}

// A terminal that is closed signals a process and its group.
TEST_F(SignalTest, TwoAtOnceAreOneRequest) {
  const auto run = [] {
    InstallStopHandlers();
    // Delivers both at once, however slow the machine is.
    sigset_t both;
    sigemptyset(&both);
    sigaddset(&both, SIGTERM);
    sigaddset(&both, SIGINT);
    sigprocmask(SIG_BLOCK, &both, nullptr);
    std::raise(SIGTERM);
    std::raise(SIGINT);
    sigprocmask(SIG_UNBLOCK, &both, nullptr);
    EndOrderly();
  };
  EXPECT_EXIT(run(), ::testing::ExitedWithCode(kStopped), "");
}

TEST_F(SignalTest, AnotherAfterASecondEndsTheProcess) {
  const auto run = [] {
    InstallStopHandlers();
    std::raise(SIGTERM);
    std::this_thread::sleep_for(std::chrono::milliseconds(1050));
    std::raise(SIGINT);
    EndOrderly();
  };
  EXPECT_EXIT(run(), ::testing::KilledBySignal(SIGINT), "");
}

}  // namespace
}  // namespace enfilade
