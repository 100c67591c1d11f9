// When a solve goes on, and with which tau.

#include "solver/error_control.h"

#include "base/error.h"

#include <cmath>

#include <gtest/gtest.h>

namespace enfilade {
namespace {

constexpr double kArea = 10;  // m2

SolveState StateOf(double error) {
  SolveState state;
  state.error = error;
  state.tau = 1;
  state.mean_reflected = 1;
  state.cells.resize(2);
  return state;
}

// Links are given in millions, since few links are a case of their own.
RoundRecord Round(double predicted, double estimated, uint64_t millions) {
  RoundRecord record;
  record.tau = 1;
  record.predicted_error = predicted;
  record.estimated_error = estimated;
  record.links = millions * 1'000'000;
  return record;
}

TEST(ErrorControl, RoundsAreRelativeToTheMeanReflectedRadiosity) {
  SolveState state = StateOf(0.1);
  for (CellRow& row : state.cells) {
    row.reflected = 20;       // W: 4 W/m2 on the average of 10 m2
    row.squared_error = 0.8;  // root of the mean square: 0.4 W/m2
    row.changed = 7.2;        // 1.2 W/m2
    row.residual = 0.2;
    row.links = 50;
  }
  const RoundRecord first = RecordRound(&state, kArea);
  EXPECT_DOUBLE_EQ(state.mean_reflected, 4);
  EXPECT_DOUBLE_EQ(state.residual, 0.01);
  EXPECT_DOUBLE_EQ(first.predicted_error, 0.1);
  EXPECT_DOUBLE_EQ(first.observed_change, 0.3);
  EXPECT_EQ(first.links, 100U);
  EXPECT_LT(first.estimated_error, 0.3) << "there is no round before it";
  // After a round with as many links as the one before, the change is the
  // error.
  state.rounds.push_back(first);
  EXPECT_DOUBLE_EQ(RecordRound(&state, kArea).estimated_error, 0.3);
}

TEST(ErrorControl, OneRoundIsNeverEnough) {
  SolveState state = StateOf(0.1);
  state.rounds = {Round(0.01, 0.01, 10)};
  EXPECT_FALSE(HasMetError(state));
  state.rounds.push_back(Round(0.01, 0.01, 20));
  EXPECT_TRUE(HasMetError(state));
  state.rounds.back().estimated_error = 0.11;
  EXPECT_FALSE(HasMetError(state));
}

TEST(ErrorControl, ARoundThatLitCellsLateDoesNotCount) {
  SolveState state = StateOf(0.1);
  state.rounds = {Round(0.01, 0.01, 10), Round(0.01, 0.01, 20)};
  state.rounds.back().late = 1;
  EXPECT_FALSE(HasMetError(state));
}

// In polygon soups, light keeps seeping into the walls.
TEST(ErrorControl, LateLightCountsFromAHundredthOfTheErrorOn) {
  constexpr double kError = 0.1;
  const auto ends = [](double share, uint64_t late_in) {
    SolveState state = StateOf(kError);
    state.round = 2;
    CellRow lit;
    lit.reflected = 100;
    CellRow late;
    late.reflected = share * lit.reflected;
    late.lit_late_in = late_in;
    state.cells = {lit, late};
    state.rounds = {Round(0.01, 0.01, 10), Round(0.01, 0.01, 20)};
    state.rounds.push_back(RecordRound(&state, kArea));
    return HasMetError(state);
  };
  EXPECT_FALSE(ends(0.02 * kError, 3));
  EXPECT_TRUE(ends(0.02 * kError, 2)) << "it was late in an earlier round";
  EXPECT_TRUE(ends(0.005 * kError, 3));
}

// Bounds with no uncertainty: the rays are sure of this error.
RayBounds Sure(double error) {
  return {error, error};
}

TEST(ErrorControl, RaysStandForThePredictionAndNotForTheChange) {
  SolveState state = StateOf(0.1);
  state.rounds = {Round(0.1, 0.14, 10), Round(0.1, 0.14, 10)};
  EXPECT_TRUE(IsWorthChecking(state));
  TakeResidual(Sure(0.05), &state);
  EXPECT_EQ(state.rounds.back().residual_error, 0.05);
  EXPECT_LT(state.rounds.back().estimated_error, 0.1) << "light is smooth";
  EXPECT_TRUE(HasMetError(state));
  TakeResidual(Sure(1.01 * 0.1), &state);
  EXPECT_FALSE(HasMetError(state));
  const double tau = NextTau(state);
  TakeResidual(Sure(2 * 0.1), &state);
  EXPECT_LT(NextTau(state), tau);
  // The round has no more links than the one before, so the change of the light
  // is the error.
  state.rounds.back().observed_change = 0.3;
  TakeResidual(Sure(0.05), &state);
  EXPECT_DOUBLE_EQ(state.rounds.back().estimated_error, 0.3);
}

TEST(ErrorControl, ThePredictionIsBelievedWhereRaysAreNotSure) {
  SolveState state = StateOf(0.1);
  state.rounds = {Round(0.05, 0.07, 10), Round(0.05, 0.07, 10)};
  const double predicted = state.rounds[1].estimated_error;
  TakeResidual({0, 1, 1.5}, &state);
  EXPECT_EQ(state.rounds[1].most_by_rays, 1.5);
  EXPECT_NEAR(state.rounds[1].estimated_error, predicted, 0.05 * predicted);
  TakeResidual({0, 0.01}, &state);
  EXPECT_NEAR(state.rounds[1].estimated_error, 0.01, 1e-12);
  TakeResidual({0.2, 0.3}, &state);
  EXPECT_NEAR(state.rounds[1].estimated_error, 0.2, 1e-12);
}

// If rays measured both rounds, they tell what share of the change is left.
TEST(ErrorControl, ErrorFallsAsRaysSay) {
  SolveState state = StateOf(0.1);
  state.rounds = {Round(0.2, 0.3, 10), Round(0.1, 0.3, 20)};
  state.rounds[0].residual_error = 0.2;
  state.rounds[1].observed_change = 0.4;
  TakeResidual(Sure(0.02), &state);
  EXPECT_DOUBLE_EQ(state.rounds[1].estimated_error, 0.04);
}

// A round that mends a large error changes much. That change is not the round's
// error: the error is not met, and the change is no reason for a long step.
TEST(ErrorControl, TheNextTauIsNotChosenByTheChange) {
  const auto step = [](double change) {
    SolveState state = StateOf(0.1);
    state.rounds = {Round(0.2, 0.3, 10), Round(0.1, 0.3, 20)};
    state.rounds[1].observed_change = change;
    TakeResidual(Sure(0.13), &state);
    EXPECT_FALSE(HasMetError(state));
    return NextTau(state);
  };
  EXPECT_EQ(step(10), step(0));
}

// The requested error gives tau by the power law of the last two rounds, held
// to what is known of errors: they fall with between the 2.2th and the 3.2th
// root of tau.
TEST(ErrorControl, TheNextTauFollowsTheRateThatRaysSaw) {
  const auto step = [](double before) {
    SolveState state = StateOf(0.1);
    state.rounds = {
        Round(0.4, 0.4, 5), Round(0.3, 0.3, 10), Round(0.2, 0.2, 20)};
    state.rounds[1].tau = 8;
    state.rounds[1].residual_error = before;
    state.rounds[2].residual_error = 0.16;
    return NextTau(state);
  };
  EXPECT_LT(step(0.16 * 2), step(0.16 * 2.4))
      << "the third root, and the 2.4th";
  EXPECT_EQ(step(0.16 * 1.01), step(0.16 * 1.5)) << "both beyond the 3.2th";
}

// The links of the first round were made before the light was known.
TEST(ErrorControl, TheRateOfTheFirstRoundDoesNotCount) {
  const auto step = [](double first) {
    SolveState state = StateOf(0.1);
    state.rounds = {Round(0.3, 0.3, 10), Round(0.2, 0.2, 20)};
    state.rounds[0].tau = 8;
    state.rounds[0].residual_error = first;
    state.rounds[1].residual_error = 0.16;
    return NextTau(state);
  };
  EXPECT_EQ(step(0.16 * 2), step(0.16 * 2.4));
}

// The next tau need not mend what care will mend; if care mends much, tau may
// stay.
TEST(ErrorControl, TheNextTauIsForWhatCareLeaves) {
  const auto step = [](double cared_for) {
    SolveState state = StateOf(0.1);
    state.rounds = {Round(0.3, 0.3, 10), Round(0.2, 0.2, 20)};
    TakeResidual(Sure(0.16), &state);
    state.rounds[1].cared_for = cared_for;
    return NextTau(state);
  };
  EXPECT_LT(step(0), step(0.2));
  EXPECT_LT(step(0.2), 1);
  EXPECT_EQ(step(0.9), 1);
}

TEST(ErrorControl, TheResidualIsNotAskedForFarFromTheError) {
  SolveState state = StateOf(0.1);
  state.rounds = {Round(0.05, 0.09, 10)};
  EXPECT_TRUE(IsWorthChecking(state)) << "it says how far to go";
  EXPECT_FALSE(HasMetError(state)) << "one round is never enough";
  state.rounds.push_back(Round(0.9, 1.2, 20));
  EXPECT_FALSE(IsWorthChecking(state));
  state.rounds.back() = Round(0.05, 0.09, 20);
  state.rounds.back().late = 1;
  EXPECT_FALSE(IsWorthChecking(state)) << "there are links to come";
}

// After cells were lit late, the change of the next round is their light.
TEST(ErrorControl, TheResidualStandsForAChangeByLight) {
  SolveState state = StateOf(0.1);
  state.rounds = {Round(0.05, 0.07, 10), Round(0.05, 2, 20)};
  state.rounds[0].late = 1;
  EXPECT_TRUE(IsWorthChecking(state));
  TakeResidual(Sure(0.06), &state);
  EXPECT_LT(state.rounds.back().estimated_error, 0.1);
  EXPECT_TRUE(HasMetError(state));
}

TEST(ErrorControl, GivesUpWhereMoreLinksHelpNeitherWay) {
  SolveState state = StateOf(0.1);
  state.rounds = {
      Round(0.5, 0.7, 10), Round(0.5, 0.7, 20), Round(0.5, 0.7, 40)};
  EXPECT_TRUE(IsExhausted(state));
  state.rounds[2].predicted_error = 0.3;
  EXPECT_FALSE(IsExhausted(state)) << "the prediction falls";
  state.rounds[2] = Round(0.5, 0.5, 40);
  EXPECT_FALSE(IsExhausted(state)) << "the estimate falls";
  state.rounds[2] = Round(0.5, 0.7, 20);
  EXPECT_FALSE(IsExhausted(state)) << "there are no more links";
}

// Where links are few, the error goes up and down by chance.
TEST(ErrorControl, FewLinksAreNoReasonToGiveUp) {
  SolveState state = StateOf(0.1);
  state.rounds = {Round(0.5, 0.7, 1), Round(0.5, 0.7, 2), Round(0.5, 0.7, 40)};
  ASSERT_TRUE(IsExhausted(state));
  for (RoundRecord& round : state.rounds) {
    round.links /= 1000;
  }
  EXPECT_FALSE(IsExhausted(state));
}

TEST(ErrorControl, TauFallsUntilTheErrorIsMet) {
  SolveState state = StateOf(0.1);
  state.rounds = {
      Round(0.2, 0.2, 10), Round(0.2, 0.2, 20), Round(0.2, 0.2, 40)};
  const double larger = NextTau(state);
  EXPECT_LT(larger, state.tau);
  state.error = 0.05;
  EXPECT_LT(NextTau(state), larger);
  state.error = 0.5;  // the error is not met for another reason: a small step
  EXPECT_LT(NextTau(state), state.tau);
}

// Slivers between crossing faces make estimates go up and down from round to
// round, and no two successive estimates are alike.
TEST(ErrorControl, LinksThatGrowInVainEndASolve) {
  const auto ends = [](double last, uint64_t millions) {
    SolveState state = StateOf(0.1);
    state.rounds = {Round(0.12, 0.16, 1), Round(0.1, 0.14, 1)};
    for (const double seen : {0.115, 0.138, 0.154, last}) {
      state.rounds.push_back(Round(0.1, 0.14, 2));
      TakeResidual(Sure(seen), &state);
    }
    state.rounds.back().links = millions * 1'000'000;
    return IsExhausted(state);
  };
  EXPECT_TRUE(ends(0.123, 20));
  EXPECT_FALSE(ends(0.123, 12)) << "of few more not much was to be had";
  EXPECT_FALSE(ends(0.102, 20)) << "it has come down";
  SolveState state = StateOf(0.1);
  state.rounds = {
      Round(0.05, 0.07, 1), Round(0.1, 0.14, 4), Round(0.1, 0.14, 8)};
  state.rounds.push_back(Round(0.1, 0.14, 20));
  TakeResidual(Sure(0.11), &state);
  EXPECT_FALSE(IsExhausted(state)) << "nobody saw the first";
}

// A finished solve of so many rounds, the last of which has the given estimate.
SolveState DoneAt(double error, double estimated, size_t rounds) {
  SolveState state = StateOf(error);
  for (size_t i = 0; i < rounds; ++i) {
    // Each round has as many links as the one before but is better by a tenth.
    state.rounds.push_back(Round(1, estimated, 10));
    state.rounds.back().predicted_error /= 1.0 + 0.1 * static_cast<double>(i);
    state.rounds.back().estimated_error /=
        1.0 + 0.1 * (static_cast<double>(i) + 1 - static_cast<double>(rounds));
  }
  state.phase = SolvePhase::kDone;
  state.converged = HasMetError(state);
  return state;
}

TEST(ErrorControl, ASmallerErrorThatIsMetAlreadyAsksForNothing) {
  SolveState state = DoneAt(0.1, 0.04, 3);
  EXPECT_EQ(TakeRequest(0.05, &state), RequestStep::kGoOn);
  EXPECT_TRUE(state.converged);
  EXPECT_EQ(state.error, 0.05);
  EXPECT_EQ(TakeRequest(0.03, &state), RequestStep::kNewRound);
}

TEST(ErrorControl, ALargerErrorThatIsMetNowIsConverged) {
  SolveState state = DoneAt(0.05, 0.08, 3);
  ASSERT_FALSE(state.converged);
  EXPECT_EQ(TakeRequest(0.1, &state), RequestStep::kGoOn);
  EXPECT_TRUE(state.converged);
}

TEST(ErrorControl, ASolveThatRanOutOfRoundsGetsAsManyAgain) {
  SolveState state = DoneAt(0.05, 0.08, 16);
  ASSERT_TRUE(HasSpentItsRounds(state));
  ASSERT_FALSE(IsExhausted(state));
  EXPECT_EQ(TakeRequest(0.05, &state), RequestStep::kNewRound);
  EXPECT_FALSE(HasSpentItsRounds(state));
}

TEST(ErrorControl, ASolveThatMoreLinksDoNotHelpIsLeftAsItIs) {
  SolveState state = StateOf(0.05);
  state.rounds = {
      Round(0.08, 0.08, 10), Round(0.08, 0.08, 20), Round(0.08, 0.08, 30)};
  state.phase = SolvePhase::kDone;
  ASSERT_TRUE(IsExhausted(state));
  EXPECT_EQ(TakeRequest(0.05, &state), RequestStep::kGoOn);
}

TEST(ErrorControl, AStateOfOtherCellsIsDamaged) {
  SolveState state = StateOf(0.1);
  EXPECT_NO_THROW(RequireSense(state, 2));
  EXPECT_THROW(RequireSense(state, 3), DamagedStoreError);
  state.next_cell = 3;
  EXPECT_THROW(RequireSense(state, 2), DamagedStoreError);
}

// A round of few links is cheap, and a long step might end far below the error
// that is asked for.
TEST(ErrorControl, FewLinksAreMadeByShortSteps) {
  const auto step = [](uint64_t links) {
    SolveState state = StateOf(0.01);
    state.rounds = {Round(0.5, 0.675, 1)};
    state.rounds[0].links = links;
    return NextTau(state) / state.tau;
  };
  EXPECT_DOUBLE_EQ(step(100), 1.0 / 2);
  EXPECT_DOUBLE_EQ(step(10'000), 1.0 / 4);
  EXPECT_LT(step(10'000'000), 1.0 / 8);
}

// After a round that was unlucky, the next one need not be much finer.
TEST(ErrorControl, ANearMissIsFollowedByAShortStep) {
  const auto step = [](double error) {
    SolveState state = StateOf(0.1);
    state.rounds = {Round(0.3, 0.3, 5), Round(0.2, 0.2, 10)};
    TakeResidual(Sure(error), &state);
    return NextTau(state) / state.tau;
  };
  EXPECT_DOUBLE_EQ(step(0.101), 0.85) << "at most";
  EXPECT_GT(step(0.108), 0.7);
  EXPECT_LT(step(0.108), step(0.104));
  EXPECT_LT(step(0.126), 0.9 * step(0.124)) << "it had not aimed at 0.1";
}

TEST(ErrorControl, ARoundOfVeryManyLinksWasNotUnlucky) {
  const auto step = [](uint64_t links) {
    SolveState state = StateOf(0.1);
    state.rounds = {Round(0.3, 0.3, 10), Round(0.2, 0.2, 20)};
    state.rounds[1].links = links;
    TakeResidual(Sure(0.108), &state);
    return NextTau(state) / state.tau;
  };
  EXPECT_LT(step(40'000'000), 0.9 * step(10'000'000));
}

TEST(ErrorControl, OnlyTheFirstTauMayHaveBeenTooSmall) {
  SolveState state = StateOf(0.2);
  state.rounds = {Round(0.01, 0.0135, 10)};
  EXPECT_GT(NextTau(state), state.tau);
  state.rounds[0].late = 1;
  EXPECT_EQ(NextTau(state), state.tau) << "its links do not tell";
  state.rounds[0].late = 0;
  state.rounds.push_back(state.rounds[0]);
  EXPECT_LT(NextTau(state), state.tau);
}

// The links of the first round were made before the light was known; the second
// round should not narrowly miss the error.
TEST(ErrorControl, AFirstRoundThatClaimsToDoIsDoubted) {
  SolveState state = StateOf(0.1);
  state.rounds = {Round(0.07, 0.0945, 10)};
  state.rounds[0].late = 0.2;
  EXPECT_LT(NextTau(state), 0.5 * state.tau);
  state.rounds[0].predicted_error = 0.04;
  EXPECT_EQ(NextTau(state), state.tau) << "with room for such doubts";
}

TEST(ErrorControl, UnsentRadiosityIsMeasuredByTheErrorAskedFor) {
  SolveState state = StateOf(0.1);
  state.rounds = {Round(0.05, 0.07, 10), Round(0.05, 0.07, 20)};
  CellRow row;
  row.area = 3;
  const double at_01 = ToleratedResidual(state, row);
  EXPECT_LT(at_01, 0.1 * state.mean_reflected * row.area);
  state.error = 0.2;
  EXPECT_DOUBLE_EQ(ToleratedResidual(state, row), 2 * at_01);
}

}  // namespace
}  // namespace enfilade
