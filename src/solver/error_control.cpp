#include "solver/error_control.h"

#include "base/check.h"
#include "solver/elements/cell_care.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace enfilade {
namespace {

// The first round aims at this error, with about this many links per patch.
constexpr double kFirstError = 0.4;
constexpr double kFirstLinksPerPatch = 3;
// The estimated over the predicted error, and the power of the number of links
// with which the error falls. Both are measured.
constexpr double kPredictionFactor = 1.35;
constexpr double kErrorPerLinks = 0.4;
// The first round makes its links before most of the light has arrived. Its
// error is 1.0 to 2.1 times the predicted one; this is the average
// (docs/decisions/0012-error-estimate.md).
constexpr double kFirstPrediction = 1.5;
// Rays check predictions up to this multiple of the requested error, because
// predictions are several times too large where light is smooth.
constexpr double kCheckedFrom = 5;
// tau falls as a power of the error. If rays have measured the last two rounds,
// NextTau uses their power, clamped to these bounds; otherwise it uses
// kTauPerError.
constexpr double kLeastTauPerError = 2.2;
constexpr double kMostTauPerError = 3.2;
// A round aims at this share of the requested error so that it does not miss
// the request by chance.
constexpr double kErrorMargin = 0.92;
// A round that misses the requested error by at most this factor was aimed
// correctly but unlucky. With other random numbers, and care, the next round
// leaves kLeftByChance of its error at the same tau.
constexpr double kNearMiss = 1.25;
constexpr double kLeftByChance = 0.94;
// A round with more links than this does not owe its error to chance, and an
// unnecessary further round would be expensive.
constexpr uint64_t kTooManyForLuck = 16'000'000;
// A round aims to leave at least this share of the squared error; tau is not
// lowered further.
constexpr double kLeastLeft = 0.15;
// The largest ratio of the next tau to the last one: after a near miss, and
// after any other round.
constexpr double kMostStepOfNearMiss = 0.85;
constexpr double kMostStep = 0.7;
// After the first round, whose tau was a guess and may have been too small.
constexpr double kMostStepOfGuess = 3;
// The smallest ratio of the next tau to the last one.
constexpr double kLeastStep = 1.0 / 12;
constexpr double kLeastStepOfRatherFew = 1.0 / 4;
constexpr double kLeastStepOfFew = 1.0 / 2;
// If care removes more than this share of the squared error, a round at the
// same tau is worthwhile.
constexpr double kMuchCaredFor = 0.3;
// A round with few links costs less than the rays that measure it, and each
// additional link is felt. tau then falls in short steps, so that the error
// does not end far below the request.
constexpr uint64_t kFewLinks = 1'000;
constexpr uint64_t kRatherFewLinks = 20'000;
// A round with fewer links than this takes a second or two, and its error is as
// much chance as rule: it does not tell that more links would not help.
constexpr uint64_t kTooFewToGiveUp = 200'000;
// This factor more links, at least kRoundsInVain rounds later, should halve the
// error. If they leave more than kLeftInVain of the error, more links will not
// help.
constexpr uint64_t kGrowthInVain = 8;
constexpr size_t kRoundsInVain = 3;
constexpr double kLeftInVain = 0.9;
// A round that leaves more than this share of the previous error has not
// helped.
constexpr double kNoBetter = 0.97;
// The light reflected by cells that were lit too late for other cells may be
// this share of the requested error, relative to all reflected light. In
// polygon soups, light keeps seeping into walls.
constexpr double kLateShare = 0.01;
// The most rounds of one request.
constexpr size_t kMostRounds = 16;
// Unsent radiosity may stay up to kResidualShare of an error: the requested
// error, or kOfLastRound of the last round's estimated error if that is larger.
constexpr double kResidualShare = 0.01;
constexpr double kOfLastRound = 0.5;

// Whether cells were lit too late in a round, and so brightly that it matters.
bool IsRelit(const RoundRecord& round, const SolveState& state) {
  return round.late > kLateShare * state.error;
}

// Whether the change of the last round comes from cells that were lit too late
// for the round before.
bool ChangedByLight(const SolveState& state) {
  const size_t rounds = state.rounds.size();
  return rounds > 1 && IsRelit(state.rounds[rounds - 2], state);
}

// Estimates the error of a round from its change. The change is about the error
// of the round before, and the error falls with the number of links, or faster
// if rays say so.
double ErrorByChange(const RoundRecord& before, const RoundRecord& now) {
  const double growth =
      static_cast<double>(now.links) /
      static_cast<double>(std::max<uint64_t>(before.links, 1));
  double left = std::pow(std::max(growth, 1.0), -kErrorPerLinks);
  if (now.residual_error > 0 && before.residual_error > 0) {
    left = std::min(left, now.residual_error / before.residual_error);
  }
  return now.observed_change * left;
}

// The same for the last round; 0 if its change says nothing.
double ErrorByChange(const SolveState& state) {
  const size_t rounds = state.rounds.size();
  return rounds < 2 || ChangedByLight(state)
             ? 0
             : ErrorByChange(state.rounds[rounds - 2], state.rounds.back());
}

// The share of a round's error that remains after the care taken at its end.
double LeftByCare(const RoundRecord& round) {
  return std::sqrt(1 - round.cared_for);
}

// The error that the last round's links predict. Using the first round's
// prediction as it is makes the second round coarse and cheap. But if the
// prediction already meets the requested error, the second round should be the
// last one, so kFirstPrediction raises the prediction.
double Predicted(const SolveState& state) {
  const double predicted =
      kPredictionFactor * state.rounds.back().predicted_error;
  const bool claims_enough =
      state.rounds.size() == 1 && predicted <= state.error;
  return predicted * (claims_enough ? kFirstPrediction : 1);
}

// Whether the last round has missed the requested error by so little that
// chance explains it. A round with few links does not count: each additional
// link is felt, and tau may have to fall far to make a difference.
bool IsNearMiss(const RoundRecord& last, const SolveState& state) {
  return state.rounds.size() > 1 && last.links >= kFewLinks &&
         last.residual_error > 0 &&
         last.residual_error <= kNearMiss * state.error;
}

// The smallest ratio of the next tau to that of the last round.
double LeastStep(const RoundRecord& last, const SolveState& state) {
  if (last.links < kFewLinks) {
    return kLeastStepOfFew;
  }
  return last.links < kRatherFewLinks || IsRelit(last, state)
             ? kLeastStepOfRatherFew
             : kLeastStep;
}

// The largest ratio of the next tau to that of the last round.
double MostStep(const RoundRecord& last, const SolveState& state) {
  if (state.rounds.size() == 1) {
    // If cells were lit late, the round had too few links to judge by.
    return IsRelit(last, state) ? 1 : kMostStepOfGuess;
  }
  if (last.cared_for > kMuchCaredFor) {
    return 1;
  }
  return IsNearMiss(last, state) ? kMostStepOfNearMiss : kMostStep;
}

// The share of the error that the next round would leave at the same tau.
double LeftAtSameTau(const RoundRecord& last, const SolveState& state) {
  const bool was_unlucky =
      IsNearMiss(last, state) && last.links <= kTooManyForLuck;
  return LeftByCare(last) * (was_unlucky ? kLeftByChance : 1);
}

// The power of the error with which tau falls, from the last two rounds if rays
// measured both. The first round does not count: its links are made in the dark
// and err more than tau says.
double TauPerError(const SolveState& state) {
  const size_t rounds = state.rounds.size();
  if (rounds < 3) {
    return kTauPerError;
  }
  const RoundRecord& before = state.rounds[rounds - 2];
  const RoundRecord& last = state.rounds.back();
  if (!(before.residual_error > 0 && last.residual_error > 0)) {
    return kTauPerError;
  }
  const double error = std::log(last.residual_error /
                                (before.residual_error * LeftByCare(before)));
  const double tau = std::log(last.tau / before.tau);
  return error < 0 && tau < 0
             ? std::clamp(tau / error, kLeastTauPerError, kMostTauPerError)
             : kTauPerError;
}

// Whether the last round has many times the links of an earlier round and is no
// better.
bool HasGrownInVain(const SolveState& state) {
  const RoundRecord& last = state.rounds.back();
  if (!(last.residual_error > 0)) {
    return false;
  }
  const size_t n = state.rounds.size();
  for (size_t i = 0; i + kRoundsInVain < n; ++i) {
    const RoundRecord& before = state.rounds[i];
    if (before.residual_error > 0 &&
        last.links >= kGrowthInVain * before.links &&
        last.residual_error > kLeftInVain * before.residual_error) {
      return true;
    }
  }
  return false;
}

}  // namespace

double FirstTau(const SolveState& state, double area, double patches) {
  return std::max(kFirstError, state.error) * state.mean_reflected *
         std::sqrt(area / (kFirstLinksPerPatch * patches + 1));
}

RoundRecord RecordRound(SolveState* state, double area) {
  double reflected = 0;
  double residual = 0;
  double squared_error = 0;
  double changed = 0;
  double late = 0;
  RoundRecord record;
  for (const CellRow& row : state->cells) {
    reflected += row.reflected;
    residual += row.residual;
    squared_error += row.squared_error;
    changed += row.changed;
    record.links += row.links;
    late += row.lit_late_in == state->round + uint64_t{1} ? row.reflected : 0;
  }
  state->mean_reflected = std::max(reflected / area, 1e-30);
  state->residual = residual / std::max(reflected, 1e-30);
  record.tau = state->tau;
  record.late = late / std::max(reflected, 1e-30);
  record.predicted_error =
      std::sqrt(squared_error / area) / state->mean_reflected;
  record.observed_change = std::sqrt(changed / area) / state->mean_reflected;
  record.estimated_error = kPredictionFactor * record.predicted_error;
  if (!state->rounds.empty()) {
    record.estimated_error = std::max(
        record.estimated_error, ErrorByChange(state->rounds.back(), record));
  }
  return record;
}

bool HasMetError(const SolveState& state) {
  const RoundRecord& last = state.rounds.back();
  return state.rounds.size() > 1 && !IsRelit(last, state) &&
         last.estimated_error <= state.error;
}

bool IsWorthChecking(const SolveState& state) {
  const RoundRecord& last = state.rounds.back();
  return !IsRelit(last, state) &&
         kPredictionFactor * last.predicted_error <= kCheckedFrom * state.error;
}

void TakeResidual(RayBounds rays, SolveState* state) {
  ENFILADE_CHECK(rays.least <= rays.most,
                 "an error of at least {} and at most {}",
                 rays.least,
                 rays.most);
  RoundRecord& last = state->rounds.back();
  last.residual_error = std::clamp(
      kPredictionFactor * last.predicted_error, rays.least, rays.most);
  last.most_by_rays = rays.high;
  last.estimated_error = std::max(ErrorByChange(*state), last.residual_error);
}

double WantedOfSquare(const SolveState& state) {
  const double seen = state.rounds.back().residual_error;
  const double left = kErrorMargin * state.error / std::max(seen, 1e-30);
  return std::max(left * left, kLeastLeft);
}

bool IsExhausted(const SolveState& state) {
  if (state.rounds.back().links < kTooFewToGiveUp) {
    return false;
  }
  if (HasGrownInVain(state)) {
    return true;
  }
  const size_t n = state.rounds.size();
  if (n < 3) {
    return false;
  }
  // The change of a rough round says little, so the prediction must not have
  // fallen either.
  const auto in_vain = [&](size_t i) {
    const RoundRecord& last = state.rounds[i - 1];
    const RoundRecord& now = state.rounds[i];
    return !IsRelit(last, state) && !IsRelit(now, state) &&
           now.links > last.links &&
           now.estimated_error > kNoBetter * last.estimated_error &&
           now.predicted_error > kNoBetter * last.predicted_error;
  };
  return in_vain(n - 1) && in_vain(n - 2);
}

bool HasSpentItsRounds(const SolveState& state) {
  return state.rounds.size() >= state.first_round + kMostRounds;
}

RequestStep TakeRequest(double error, SolveState* state) {
  const bool is_done = state->phase == SolvePhase::kDone;
  const bool ran_out = is_done && !state->converged &&
                       HasSpentItsRounds(*state) && !IsExhausted(*state);
  const double before = std::exchange(state->error, error);
  if (error == before && !ran_out) {
    return RequestStep::kGoOn;
  }
  state->first_round = state->rounds.size();
  const bool asks_more = error < before;
  bool starts = false;
  if (is_done) {
    state->converged = HasMetError(*state);
    starts = (asks_more || ran_out) && !state->converged;
  } else if (state->phase == SolvePhase::kRefine && !state->rounds.empty()) {
    starts = !asks_more;
  }
  return starts ? RequestStep::kNewRound : RequestStep::kGoOn;
}

double NextTau(const SolveState& state) {
  // The change of the second round shows how rough the first round was. The
  // change after cells were lit late shows light that had not arrived before.
  // Neither justifies a long step.
  const RoundRecord& last = state.rounds.back();
  const size_t rounds = state.rounds.size();
  const bool by_prediction =
      !(last.residual_error > 0) &&
      (rounds <= 2 || IsRelit(last, state) || ChangedByLight(state));
  // Rays measure the present error. The change of a round tells of the round
  // before and may be far larger.
  const double seen =
      last.residual_error > 0 ? last.residual_error : last.estimated_error;
  const double estimated = by_prediction ? Predicted(state) : seen;
  // The share of the error that the next round should leave, divided by the
  // share that it leaves at the same tau. Lowering tau has to achieve the
  // quotient.
  const double wanted =
      std::max(kErrorMargin * state.error / std::max(estimated, 1e-30),
               std::sqrt(kLeastLeft)) /
      LeftAtSameTau(last, state);
  return state.tau * std::clamp(std::pow(wanted, TauPerError(state)),
                                LeastStep(last, state),
                                MostStep(last, state));
}

double ToleratedResidual(const SolveState& state, const CellRow& row) {
  const double error =
      state.rounds.empty()
          ? kFirstError
          : std::max(state.error,
                     kOfLastRound * state.rounds.back().estimated_error);
  return kResidualShare * error * state.mean_reflected * row.area;
}

}  // namespace enfilade
