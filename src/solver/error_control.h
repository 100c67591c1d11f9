// Estimates the error of a solve after each round and decides what the next
// round tries: docs/decisions/0012-error-estimate.md.

#pragma once

#include "solver/state/solve_state.h"

#include <cstdint>

namespace enfilade {

// The tau of the first round, W/m, from what is known beforehand: `area` is
// that of all reflecting patches in m2, `patches` is their number.
double FirstTau(const SolveState& state, double area, double patches);

// The record of the round that has just ended, from the rows of the cells. Sets
// the state's mean reflected radiosity and residual. `area` is as above.
RoundRecord RecordRound(SolveState* state, double area);

// Whether the last round counts as having met the requested error.
bool HasMetError(const SolveState& state);

// Whether rays should measure the residual of the last round: its predicted
// error is at most a few times the requested error, and no cell was lit late.
bool IsWorthChecking(const SolveState& state);

// What rays say of a relative error: TakeResidual believes another estimate of
// that error only between `least` and `most` (residual_estimate.h).
struct RayBounds {
  double least = 0;
  double most = 0;
  double high = 0;  // upper end of the 95 % interval
};

// Clamps the predicted error of the last round to the ray bounds. Where the
// bounds are tight, they replace the prediction. The estimated error becomes
// the clamped value, or the error by what the round changed if that is larger.
void TakeResidual(RayBounds rays, SolveState* state);

// The share of the ray-measured squared error that the next round should leave:
// what the requested error allows, less a margin, but at least the share that
// one round aims to keep.
double WantedOfSquare(const SolveState& state);

// Whether refinement cannot reduce the error further: more links have not
// helped for two rounds, or have not helped since a round with far fewer links.
bool IsExhausted(const SolveState& state);

// Whether the request has used up the rounds that one request may have.
bool HasSpentItsRounds(const SolveState& state);

// What a request for an error asks of a solve that has already begun.
enum class RequestStep : uint8_t {
  kGoOn,      // continue the round under way, if any
  kNewRound,  // refine the solution further
};

// Takes a request, whose error may differ from that of the run before. A round
// in progress is judged by the new error when the round ends. But if the new
// error is larger, a refinement in progress begins anew, because its many links
// may be what did not fit. A solve that has spent its rounds gets as many
// again.
RequestStep TakeRequest(double error, SolveState* state);

// The tau of the next round, W/m.
double NextTau(const SolveState& state);

// The unsent radiosity that a cell may keep, integrated over it, W.
double ToleratedResidual(const SolveState& state, const CellRow& row);

}  // namespace enfilade
