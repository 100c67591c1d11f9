#include "solver/state/commit_clock.h"

#include "base/stopwatch.h"

#include <algorithm>

namespace enfilade {
namespace {

// The work between two commits takes kWorkPerCommit times as long as a commit,
// but at most kMostSeconds.
constexpr double kWorkPerCommit = 20;
constexpr double kMostSeconds = 60;

}  // namespace

CommitClock::CommitClock(double least_seconds)
    : least_seconds_(least_seconds),
      seconds_(least_seconds),
      last_(std::chrono::steady_clock::now()) {}

bool CommitClock::IsDue() const {
  return SecondsSince(last_) >= seconds_;
}

void CommitClock::Begin() {
  last_ = std::chrono::steady_clock::now();
}

void CommitClock::End() {
  const double work =
      std::min(kWorkPerCommit * SecondsSince(last_), kMostSeconds);
  seconds_ = least_seconds_ > 0 ? std::max(least_seconds_, work) : 0;
  last_ = std::chrono::steady_clock::now();
}

}  // namespace enfilade
