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
// Estimated over predicted error, and the power of the number of links by which
// error falls, both measured.
constexpr double kPredictionFactor = 1.35;
constexpr double kErrorPerLinks = 0.4;
// Links of the first round are made before most of the light has come: its
// error is 1.0 to 2.1 times what they predict, this on average
// (docs/decisions/0012-error-estimate.md).
constexpr double kFirstPrediction = 1.5;
// Predictions up to this multiple of the requested error are checked: where
// light is smooth, they are several times too large.
constexpr double kCheckedFrom = 5;
// Where rays saw two rounds, the power of the error that tau is (kTauPerError
// otherwise) is theirs, within these.
constexpr double kLeastTauPerError = 2.2;
constexpr double kMostTauPerError = 3.2;
// A round aims at this share of the requested error, lest it misses by chance.
constexpr double kErrorMargin = 0.92;
// A round that misses by no more than this had aimed at the error and was not
// lucky: with other random numbers, and care, the next one errs less by itself.
constexpr double kNearMiss = 1.25;
constexpr double kLeftByChance = 0.94;
// Nor does one of more links than this owe its error to chance, and another
// round too many would be dear.
constexpr uint64_t kTooManyForLuck = 16'000'000;
// A round aims to keep at least this share of the squared error; tau is not
// lowered beyond that.
constexpr double kLeastLeft = 0.15;
// The most that tau may be after it, over what it was; and after others.
constexpr double kMostStepOfNearMiss = 0.85;
constexpr double kMostStep = 0.7;
// After the first, whose tau was a guess and may have been too small.
constexpr double kMostStepOfGuess = 3;
// The least that it may be.
constexpr double kLeastStep = 1.0 / 12;
constexpr double kLeastStepOfRatherFew = 1.0 / 4;
constexpr double kLeastStepOfFew = 1.0 / 2;
// From this share of the squared error on, what care alone mends is worth a
// round.
constexpr double kMuchCaredFor = 0.3;
// A round of few links costs less than the rays that look at it, and one link
// more or less is felt: tau is lowered by short steps, so that the error does
// not come out far smaller than requested.
constexpr uint64_t kFewLinks = 1'000;
constexpr uint64_t kRatherFewLinks = 20'000;
// So many times the links, by some rounds that rays have seen, should halve the
// error; where they leave nearly all of it, more will not help.
constexpr uint64_t kGrowthInVain = 8;
constexpr size_t kRoundsInVain = 3;
constexpr double kLeftInVain = 0.9;
// A round that leaves more than this of what the one before had has not helped.
constexpr double kNoBetter = 0.97;
// What cells reflect that were lit too late for others may be this share of the
// error of all reflected light: in soups, light goes on to seep into walls.
constexpr double kLateShare = 0.01;
// Rounds of one request.
constexpr size_t kMostRounds = 16;
// Unsent radiosity that may stay, as a share of the error of the round: of the
// requested one, or of this much of the last round's if that is larger.
constexpr double kResidualShare = 0.01;
constexpr double kOfLastRound = 0.5;

// Cells were lit too late in a round, and so brightly that it matters.
bool IsRelit(const RoundRecord& round, const SolveState& state) {
  return round.late > kLateShare * state.error;
}

// What the last round changed is the light of cells that were lit too late for
// the round before.
bool ChangedByLight(const SolveState& state) {
  const size_t rounds = state.rounds.size();
  return rounds > 1 && IsRelit(state.rounds[rounds - 2], state);
}

// The error of a round by what it changed: that is about the error of the one
// before, and error falls with the number of links, or faster where rays say
// so.
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

// Likewise of the last one; 0 where that says nothing.
double ErrorByChange(const SolveState& state) {
  const size_t rounds = state.rounds.size();
  return rounds < 2 || ChangedByLight(state)
             ? 0
             : ErrorByChange(state.rounds[rounds - 2], state.rounds.back());
}

// The error of a round that the care taken after it leaves, as a share.
double LeftByCare(const RoundRecord& round) {
  return std::sqrt(1 - round.cared_for);
}

// The error that the last round's links predict. To take the first round's at
// its word makes the second one coarse, and cheap; but where it is said to be
// good enough the second makes as many links as the last, and should do.
double Predicted(const SolveState& state) {
  const double predicted =
      kPredictionFactor * state.rounds.back().predicted_error;
  const bool claims_enough =
      state.rounds.size() == 1 && predicted <= state.error;
  return predicted * (claims_enough ? kFirstPrediction : 1);
}

// Of a round with few links, one more is felt: it may have to fall far to make
// a difference.
bool IsNearMiss(const RoundRecord& last, const SolveState& state) {
  return state.rounds.size() > 1 && last.links >= kFewLinks &&
         last.residual_error > 0 &&
         last.residual_error <= kNearMiss * state.error;
}

// The least that the next tau may be, over that of the last round.
double LeastStep(const RoundRecord& last, const SolveState& state) {
  if (last.links < kFewLinks) {
    return kLeastStepOfFew;
  }
  return last.links < kRatherFewLinks || IsRelit(last, state)
             ? kLeastStepOfRatherFew
             : kLeastStep;
}

// The most, likewise.
double MostStep(const RoundRecord& last, const SolveState& state) {
  if (state.rounds.size() == 1) {
    // Where cells were lit late there were too few links to tell.
    return IsRelit(last, state) ? 1 : kMostStepOfGuess;
  }
  if (last.cared_for > kMuchCaredFor) {
    return 1;
  }
  return IsNearMiss(last, state) ? kMostStepOfNearMiss : kMostStep;
}

// The share of the error that is left to the next round at the same tau.
double LeftAtSameTau(const RoundRecord& last, const SolveState& state) {
  const bool was_unlucky =
      IsNearMiss(last, state) && last.links <= kTooManyForLuck;
  return LeftByCare(last) * (was_unlucky ? kLeftByChance : 1);
}

// Which power of the error tau is, by the last two rounds if rays saw both. The
// first does not count: links that are made in the dark err more than by tau.
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

// The last round has many times the links of an earlier one, and is no better.
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
  if (HasGrownInVain(state)) {
    return true;
  }
  const size_t n = state.rounds.size();
  if (n < 3) {
    return false;
  }
  // What a round changed says little of rough ones: the prediction must not
  // have fallen either.
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
  // What the second round changes shows how rough the first one was, and after
  // cells were lit late it shows light that had not come yet: neither is worth
  // a long step.
  const RoundRecord& last = state.rounds.back();
  const size_t rounds = state.rounds.size();
  const bool by_prediction =
      !(last.residual_error > 0) &&
      (rounds <= 2 || IsRelit(last, state) || ChangedByLight(state));
  // Where rays have looked they know what is wrong now; what the round changed
  // tells of the one before, and may be far more.
  const double seen =
      last.residual_error > 0 ? last.residual_error : last.estimated_error;
  const double estimated = by_prediction ? Predicted(state) : seen;
  // The share of the error that the next round should leave, over what it
  // leaves by itself: the rest is for tau.
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
