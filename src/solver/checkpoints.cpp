#include "solver/checkpoints.h"

#include "base/error.h"
#include "base/stopwatch.h"

#include <fmt/format.h>

namespace enfilade {
namespace {

constexpr double kTellSeconds = 0.5;  // between two reports of progress

// Names the current sweep.
std::string SweepText(const SolveState& state) {
  const size_t round = state.rounds.size() + 1;
  return state.phase == SolvePhase::kRefine
             ? fmt::format("round {} refine", round)
             : fmt::format(
                   "round {} propagate {}", round, state.sweeps_in_round);
}

// Tells the error that earlier rounds have reached.
std::string ErrorText(const SolveState& state) {
  return state.rounds.empty() ? std::string()
                              : fmt::format("error {:.3f} so far, {} asked",
                                            state.rounds.back().estimated_error,
                                            state.error);
}

}  // namespace

Checkpoints::Checkpoints(SolveContext& context)
    : context_(&context),
      clock_(context.options.commit_seconds),
      last_told_(std::chrono::steady_clock::now()) {}

void Checkpoints::Pass() {
  const SolveOptions& options = context_->options;
  const bool stop = options.stop != nullptr && options.stop->load();
  if (stop) {
    TakeReads();
  }
  const bool commits = stop || clock_.IsDue();
  if (commits) {
    Commit();
  }
  if (stop) {
    throw InterruptedError("stopped as asked; all work is kept");
  }
  if (commits || IsTimeToTell()) {
    Tell({SweepText(context_->state),
          ShareOfSweep(),
          ErrorText(context_->state)});
  }
}

void Checkpoints::Commit() {
  SolveState& state = context_->state;
  const Stopwatch watch(&state.times.store_seconds);
  clock_.Begin();
  context_->chunks.Finish();
  if (save_turn_) {
    save_turn_();  // before the light of earlier turns is written over
  }
  context_->pager.Items().Flush();
  SaveSolveState(state, context_->store);
  context_->store.Commit();
  clock_.End();
}

void Checkpoints::TakeReads() {
  const TracedReads reads = context_->pager.Items().Trace().TakeReads();
  SolveTimes& times = context_->state.times;
  times.bytes_read += reads.read;
  times.bytes_belady += reads.belady;
  times.bytes_compulsory += reads.compulsory;
}

bool Checkpoints::IsTimeToTell() const {
  return SecondsSince(last_told_) >= kTellSeconds;
}

void Checkpoints::Tell(const SolveProgress& progress) {
  if (context_->options.progress) {
    context_->options.progress(progress);
    last_told_ = std::chrono::steady_clock::now();
  }
}

double Checkpoints::ShareOfSweep() const {
  return (static_cast<double>(context_->state.next_cell) + share_of_turn_) /
         static_cast<double>(context_->state.cells.size());
}

}  // namespace enfilade
