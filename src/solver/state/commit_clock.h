// The clock that says when a solve commits. A commit writes the whole tree of a
// cell, however little of it has changed. The work between two commits
// therefore takes many times as long as a commit, up to a limit, which bounds
// the work that a killed solve loses.

#pragma once

#include <chrono>

namespace enfilade {

class CommitClock {
 public:
  // At least `least_seconds` of work lie between two commits; with 0, every
  // step of the work is committed.
  explicit CommitClock(double least_seconds);

  [[nodiscard]] bool IsDue() const;

  // Makes a commit due at the next step, however long the last commit took.
  void MakeDue() { seconds_ = 0; }

  // Called before and after a commit.
  void Begin();
  void End();

 private:
  using Time = std::chrono::steady_clock::time_point;

  double least_seconds_;
  double seconds_;  // of work between two commits, at present
  Time last_;       // when a commit last began or ended
};

}  // namespace enfilade
