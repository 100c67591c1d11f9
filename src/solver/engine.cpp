#include "solver/engine.h"

#include "base/check.h"
#include "base/stop.h"
#include "partition/partition_store.h"
#include "solver/cell_turn.h"
#include "solver/error_control.h"
#include "solver/least_memory.h"
#include "solver/round_check.h"

#include <algorithm>
#include <cmath>

namespace enfilade {
namespace {

constexpr uint32_t kMostSweeps = 60;
// The first guess of the light assumes at most this mean reflectance.
constexpr double kMostGuessedReflectance = 0.8;
// It also assumes that at least one part in so many of the light meets what
// reflects, however large black surfaces are, such as the ground of a site.
constexpr double kMostBlackParts = 2;

}  // namespace

Engine::Engine(BlockStorage& store,
               const SolveOptions& options,
               MemoryBudget& budget)
    : context_(store, options, budget), checkpoints_(context_) {
  ReserveWorkspace();
  if (!context_.is_resumed) {
    Start();
  }
  context_.pager.Order().Watch(context_.state.cells);
  StartSweep();
}

void Engine::Run() {
  SolveState& state = context_.state;
  if (TakeRequest(context_.options.error, &state) == RequestStep::kNewRound) {
    state.tau = state.rounds.back().tau;
    ++state.round;
    StartRound(NextTau(state));
  }
  while (state.phase != SolvePhase::kDone) {
    if (state.next_cell == state.cells.size()) {
      FinishSweep();
    } else {
      RunTurn(CellId(state.next_cell));
      ++state.next_cell;
      state.cursor = {};
    }
    checkpoints_.Pass();
  }
  checkpoints_.Commit();  // a request alone has changed the state, too
}

void Engine::Start() {
  SolveState& state = context_.state;
  state.basis = context_.options.basis;
  state.seed = context_.options.seed;
  state.error = context_.options.error;
  const PatchTotals& totals = context_.totals;
  const MeasuredSurface& surface = context_.surface;
  // The mean reflected radiosity is a guess until the first round has measured
  // it. The guess assumes that no light is lost.
  const double met_area =
      std::min(totals.receiving_area, kMostBlackParts * surface.area);
  const double reflectance =
      surface.is_black
          ? double{kLeastWeightReflectance}
          : std::min(totals.reflectance_area / std::max(met_area, 1e-12),
                     kMostGuessedReflectance);
  state.mean_reflected =
      totals.emitted / surface.area * reflectance / (1 - reflectance);
  StartRound(FirstTau(state, surface.area, totals.count));
}

void Engine::StartRound(double tau) {
  SolveState& state = context_.state;
  state.tau = tau;
  state.phase = SolvePhase::kRefine;
  state.next_cell = 0;
  state.cursor = {};
  state.converged = false;
  state.published_in_sweep = false;
  state.sweeps_in_round = 0;
  context_.pager.Links().Forget();  // the round makes all links anew
  StartSweep();
}

// Tells the pager in which order cells are needed from now on.
void Engine::StartSweep() {
  context_.pager.Order().StartSweep(context_.state.phase == SolvePhase::kRefine
                                        ? SweepKind::kRefine
                                        : SweepKind::kPropagate);
}

void Engine::RunTurn(CellId cell) {
  if (context_.state.phase == SolvePhase::kRefine) {
    CellTurn(context_, checkpoints_, cell).Refine();
  } else if (CellTurn::HasNews(context_, cell)) {
    CellTurn(context_, checkpoints_, cell).Propagate();
  }
}

void Engine::FinishSweep() {
  SolveState& state = context_.state;
  const bool ends_round =
      !state.published_in_sweep || state.sweeps_in_round + 1 >= kMostSweeps;
  if (ends_round) {
    checkpoints_.TakeReads();
    checkpoints_.Commit();  // the rays may take long, and a stop ends them
  }
  ++state.sweeps;
  ++state.sweeps_in_round;
  if (ends_round) {
    FinishRound();
  } else {
    state.phase = SolvePhase::kPropagate;
    StartSweep();
    state.next_cell = 0;
    state.published_in_sweep = false;
  }
}

void Engine::FinishRound() {
  SolveState& state = context_.state;
  state.rounds.push_back(RecordRound(&state, context_.surface.area));
  ENFILADE_CHECK(std::isfinite(state.mean_reflected),
                 "the light of round {} is not finite",
                 state.rounds.size());
  checkpoints_.MakeCommitDue();  // each round's end is worth a commit
  ResidualEstimate by_rays;
  if (!context_.surface.is_black && IsWorthChecking(state)) {
    by_rays = CheckRoundByRays();
  }
  TellOfRound(by_rays);
  state.converged = HasMetError(state);
  if (state.converged || IsExhausted(state) || HasSpentItsRounds(state)) {
    state.phase = SolvePhase::kDone;
    return;
  }
  ++state.round;
  StartRound(NextTau(state));
}

// The rays need the memory that cells have had.
ResidualEstimate Engine::CheckRoundByRays() {
  context_.pager.Items().EvictAll();
  workspace_.Reset();
  const ResidualEstimate estimate = CheckRound(context_, checkpoints_);
  ReleaseFreedMemory();  // for the next round
  ReserveWorkspace();
  return estimate;
}

void Engine::TellOfRound(const ResidualEstimate& by_rays) const {
  const SolveState& state = context_.state;
  if (!context_.options.round_ended) {
    return;
  }
  const RoundRecord& record = state.rounds.back();
  RoundSummary summary;
  summary.round = state.rounds.size();
  for (const CellRow& row : state.cells) {
    summary.elements += row.elements;
  }
  summary.links = record.links;
  summary.lit_share = by_rays.lit_share;
  summary.estimated_error = record.estimated_error;
  summary.is_seen_by_rays = record.most_by_rays > 0;
  context_.options.round_ended(summary);
}

void Engine::ReserveWorkspace() {
  workspace_ = context_.pager.Items().Reserve(kSolveWorkspaceBytes,
                                              "the solver's work space");
}

}  // namespace enfilade
