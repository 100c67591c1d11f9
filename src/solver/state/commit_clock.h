// When a solve is to commit. A commit writes all of a cell's tree, however
// little of it has changed: so the work between two takes many times as long as
// one, up to a limit, which is what a killed solve loses.

#pragma once

#include <chrono>

namespace enfilade {

class CommitClock {
 public:
  // At least so many seconds of work from one commit to the next; with 0 every
  // step of the work is committed.
  explicit CommitClock(double least_seconds);

  [[nodiscard]] bool IsDue() const;

  // At the next step, whatever the last commit took.
  void MakeDue() { seconds_ = 0; }

  // Around a commit.
  void Begin();
  void End();

 private:
  using Time = std::chrono::steady_clock::time_point;

  double least_seconds_;
  double seconds_;  // of work from one commit to the next, now
  Time last_;       // when a commit began or ended
};

}  // namespace enfilade
