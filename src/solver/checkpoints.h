// Commits a solve between its steps, heeds requests to stop, and reports
// progress.

#pragma once

#include "solver/solve_context.h"
#include "solver/state/commit_clock.h"

#include <chrono>
#include <functional>
#include <string>
#include <utility>

namespace enfilade {

class Checkpoints {
 public:
  explicit Checkpoints(SolveContext& context);

  // Called at the end of a step: commits if a commit is due, and throws
  // InterruptedError if a stop was requested.
  void Pass();

  // Commits the state and all that was changed.
  void Commit();

  // Makes a commit due at the end of the step.
  void MakeCommitDue() { clock_.MakeDue(); }

  // Each commit calls `save` before the pager writes anything, for what a
  // cell's turn holds beside the pager, until SaveWith(nullptr).
  void SaveWith(std::function<void()> save) { save_turn_ = std::move(save); }

  // Adds the bytes read since the last call, and the bytes that an optimal
  // cache would have read, to the state.
  void TakeReads();

  // The share of the current cell's turn that is done.
  void SetShareOfTurn(double share) { share_of_turn_ = share; }

  // Whether the last report of progress was long ago.
  [[nodiscard]] bool IsTimeToTell() const;

  void Tell(const SolveProgress& progress);

 private:
  // As if all cells and all pairs took equally long.
  [[nodiscard]] double ShareOfSweep() const;

  SolveContext* context_;
  std::function<void()> save_turn_;
  double share_of_turn_ = 0;
  CommitClock clock_;
  std::chrono::steady_clock::time_point last_told_;
};

}  // namespace enfilade
