// The part of the engine that ends a round: it estimates the round's error and
// finds the patches that have most of it.

#include "base/check.h"
#include "base/memory.h"
#include "base/random.h"
#include "base/stopwatch.h"
#include "solver/engine.h"
#include "solver/error_control.h"
#include "solver/residual/patch_errors.h"
#include "solver/residual/residual_check.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include <fmt/format.h>

namespace enfilade {
namespace {

// Rays to confirm that the error is small: one per this many links, but at
// least kLeastDecidingRays.
constexpr uint64_t kLinksPerAcceptingRay = 4;
constexpr uint64_t kLeastDecidingRays = 2 << 20;
// Rays to locate the error if it is large: one per this many links, but at
// least kLeastDecidingRays. A round with fewer than kFewToLocate links costs
// less than that many rays and gets kLocatingRaysOfFewLinks.
constexpr uint64_t kLinksPerLocatingRay = 2;
constexpr uint64_t kFewToLocate = 20'000;
constexpr uint64_t kLocatingRaysOfFewLinks = 1 << 19;

DecidingRays RaysToDecide(uint64_t links) {
  return {std::max(kLeastDecidingRays, links / kLinksPerAcceptingRay),
          links < kFewToLocate
              ? kLocatingRaysOfFewLinks
              : std::max(kLeastDecidingRays, links / kLinksPerLocatingRay)};
}

std::string ResidualText(size_t round, const ResidualEstimate& so_far) {
  std::string text = fmt::format("round {} residual", round);
  if (so_far.points > 0) {
    text += fmt::format(", error {:.3f} [{:.3f}, {:.3f}] so far",
                        so_far.value,
                        so_far.low,
                        so_far.high);
  }
  return text;
}

}  // namespace

void Engine::FinishRound() {
  state_.rounds.push_back(RecordRound(&state_, area_));
  ENFILADE_CHECK(std::isfinite(state_.mean_reflected),
                 "the light of round {} is not finite",
                 state_.rounds.size());
  commits_.MakeDue();  // each round's end is worth a commit
  if (!is_black_ && IsWorthChecking(state_)) {
    CheckResidual();
  }
  TellOfRound();
  state_.converged = HasMetError(state_);
  if (state_.converged || IsExhausted(state_) || HasSpentItsRounds(state_)) {
    state_.phase = SolvePhase::kDone;
    return;
  }
  ++state_.round;
  StartRound(NextTau(state_));
}

void Engine::TellOfRound() const {
  if (!options_.round_ended) {
    return;
  }
  const RoundRecord& record = state_.rounds.back();
  RoundSummary summary;
  summary.round = state_.rounds.size();
  for (const CellRow& row : state_.cells) {
    summary.elements += row.elements;
  }
  summary.links = record.links;
  summary.estimated_error = record.estimated_error;
  summary.is_seen_by_rays = record.most_by_rays > 0;
  options_.round_ended(summary);
}

// Measures the error of a round by rays. FinishSweep has committed the round,
// so no cell needs to be in memory, and a stop leaves the store as it is.
void Engine::CheckResidual() {
  const Stopwatch watch(&state_.times.check_seconds);
  pager_.EvictAll();
  workspace_.Reset();
  const uint64_t links = state_.rounds.back().links;
  ResidualOptions options;
  options.seed = MixKey(state_.seed, state_.round);
  options.mean_reflected = state_.mean_reflected;
  options.decide_at = state_.error;
  options.most_rays = MostResidualRays(links);
  options.least_rays = RaysToDecide(links);
  options.unseen =
      shape_.NodeStride() == 1 ? kUnseenErrorOfConstants : kUnseenError;
  options.stop = options_.stop;
  options.progress = [this](double share, const ResidualEstimate& so_far) {
    if (IsTimeToTell()) {
      Tell(share, ResidualText(state_.rounds.size(), so_far));
    }
  };
  PatchErrors by_patch;
  const ResidualEstimate residual =
      MeasureResidual(*store_, options, *budget_, &by_patch);
  ReleaseFreedMemory();  // for the next round
  TakeResidual({residual.least, residual.most, residual.high}, &state_);
  if (state_.rounds.size() > 1) {  // the first round is a guess
    CareFor(by_patch);
  }
  workspace_ = ReserveWorkspace();
}

// Raises the care of the patches that have most of the error, so that the next
// round, at its tau, brings their error down to the wanted level.
void Engine::CareFor(const PatchErrors& errors) {
  RoundRecord& round = state_.rounds.back();
  const MemoryCharge charge(*budget_,
                            errors.MostKnown() * sizeof(LinkErrors),
                            "the errors of patches that are known");
  std::vector<LinkErrors> known;
  known.reserve(errors.MostKnown());
  LinkErrors rest = {errors.OfAll(), static_cast<double>(round.links)};
  for (size_t i = 0; i < partition_.cells.size(); ++i) {
    const size_t patches = partition_.cells[i].patches;
    const std::vector<float> square = errors.Of(CellId(i), patches);
    const CellCare care = LoadCellCare(*store_, CellId(i), patches);
    for (size_t k = 0; k < patches; ++k) {
      if (square[k] > 0) {
        known.push_back({static_cast<double>(square[k]),
                         static_cast<double>(care[k].links)});
        rest.square -= known.back().square;
        rest.links -= known.back().links;
      }
    }
  }
  rest.square = std::max(rest.square, 0.0);
  const double level = LevelOfErrors(known, rest, WantedOfSquare(state_));
  const double by_tau = RaiseOfCare(rest, level);
  double gone = 0;
  for (size_t i = 0; i < partition_.cells.size(); ++i) {
    const size_t patches = partition_.cells[i].patches;
    const std::vector<float> square = errors.Of(CellId(i), patches);
    CellCare care = LoadCellCare(*store_, CellId(i), patches);
    const double mended = RaiseCare(square, level, by_tau, &care);
    if (mended > 0) {
      SaveCellCare(care, CellId(i), *store_);
      gone += mended;
    }
  }
  round.cared_for =
      gone > 0 ? std::min(1.0, gone / std::max(errors.OfAll(), gone)) : 0.0;
}

}  // namespace enfilade
