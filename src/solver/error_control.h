// The error of a solve after each of its rounds, and what the next round is to
// try: docs/decisions/0012-error-estimate.md.

#pragma once

#include "solver/state/solve_state.h"

#include <cstdint>

namespace enfilade {

// The tau of the first round, W/m, by what is known before it: `area` of all
// reflecting patches in m2 and how many patches there are.
double FirstTau(const SolveState& state, double area, double patches);

// The round that has just ended, by the rows of the cells; sets the state's
// mean reflected radiosity and residual. `area` as above.
RoundRecord RecordRound(SolveState* state, double area);

// The error that the last round is taken to have reached is small enough.
bool HasMetError(const SolveState& state);

// Whether rays are to measure the residual of the last round: its prediction is
// within a few times of the requested error, and no cell was lit late.
bool IsWorthChecking(const SolveState& state);

// What rays say of an error, relative: another estimate of it is believed
// between these two (residual_estimate.h).
struct RayBounds {
  double least = 0;
  double most = 0;
  double high = 0;  // of the 95 % interval
};

// Clamps the prediction of the last round to what rays say of it: where they
// are sure, they replace it. The estimate follows from that, or from what the
// round changed if that says more.
void TakeResidual(RayBounds rays, SolveState* state);

// The share of the squared error seen by rays that should be left after the
// next round: what the requested error allows, with a margin, or as much as one
// round should keep.
double WantedOfSquare(const SolveState& state);

// More links have not helped, for two rounds or since much fewer of them: what
// is left cannot be refined.
bool IsExhausted(const SolveState& state);

// The request has had as many rounds as one is given.
bool HasSpentItsRounds(const SolveState& state);

// What a request for an error asks of a solve that has begun.
enum class RequestStep : uint8_t {
  kGoOn,      // with what is under way; nothing, where the solve is done
  kNewRound,  // what is there is refined further
};

// Takes a request; the error may be another than that of the run before. A
// round in progress is judged by it at its end; but one that makes more links
// than are asked for now begins anew, since it may be what did not fit. A solve
// that has spent its rounds gets as many again.
RequestStep TakeRequest(double error, SolveState* state);

// The tau of the next round, W/m.
double NextTau(const SolveState& state);

// The unsent radiosity that a cell may keep, integrated over it, W.
double ToleratedResidual(const SolveState& state, const CellRow& row);

}  // namespace enfilade
