// The state of a solve between two commits: its position in the schedule, and a
// row per cell. Everything that decides how the solve continues is in this
// state, in the trees or in the links, so that a resumed solve takes the same
// steps.

#pragma once

#include "base/block_storage.h"
#include "base/ids.h"
#include "base/packed.h"
#include "solver/state/held_gain.h"
#include "solver/state/work_part.h"

#include <cstdint>
#include <string>
#include <vector>

namespace enfilade {

// The facts about a cell that the solve knows without paging the cell in.
struct CellRow {
  // Ticks of the schedule's clock; 0: never.
  uint64_t published = 0;    // when `delta` was last changed
  uint64_t processed = 0;    // when the cell last gathered the deltas of others
  double reflected = 0;      // integral of rho H, mean of the channels, W
  double residual = 0;       // integral of |radiosity not yet sent|, W
  double changed = 0;        // integral of (change in this round)^2, W^2/m2
  double squared_error = 0;  // of this round's links, (W/m)^2
  double area = 0;           // of its patches that receive light, m2
  double radius = 0.5;       // of the transport within it (semi_iteration.h)
  double most_radius = 1;    // limit of `radius`; light grew above this limit
  float peak = 0;            // largest |radiosity|, W/m2; 0: dark
  HoldLevel hold = 0;        // how firmly the cell's gains are held
  uint64_t elements = 0;
  uint64_t links = 0;
  uint64_t lit_late_in = 0;  // the last round, from 1, in which the cell was
                             // lit only after others had passed it; 0: none
};

template <>
inline constexpr bool kIsPacked<CellRow> = sizeof(CellRow) ==
                                           5 * sizeof(uint64_t) +
                                               7 * sizeof(double) +
                                               sizeof(float) +
                                               sizeof(HoldLevel);

enum class SolvePhase : uint8_t { kRefine = 0, kPropagate = 1, kDone = 2 };

// The record of a finished refinement round.
struct RoundRecord {
  double tau = 0;
  double predicted_error = 0;  // from the oracle, relative
  double observed_change = 0;  // against the round before, relative
  double residual_error = 0;   // measured by rays, relative; 0: not measured
  // The upper end of the error by rays, with 95 % certainty.
  double most_by_rays = 0;
  double estimated_error = 0;
  // The share of the squared error by rays that the raised care alone will
  // remove, at the same tau.
  double cared_for = 0;
  // The light reflected by cells that were lit too late for links from them to
  // be made in their turn, as a share of the light reflected by all cells.
  double late = 0;
  uint64_t links = 0;
  // Reference methods: whether the round ended for its accuracy, and not for
  // want of panels or steps.
  bool complete = true;
};

// Time spent and bytes requested over all runs, kept apart from SolveState's
// other fields because they differ from run to run. Bytes count finished
// rounds, and a round in which the solve was asked to stop.
struct SolveTimes {
  double refine_seconds = 0;
  double gather_seconds = 0;
  double push_pull_seconds = 0;
  double store_seconds = 0;
  double check_seconds = 0;  // rays for the error of rounds
  uint64_t bytes_read = 0;   // by the rounds, without rays for the residual
  uint64_t bytes_belady = 0;
  uint64_t bytes_compulsory = 0;
};

// The position of the next step within a receiver.
struct PairCursor {
  uint32_t source = 0;  // index into the receiver's list of sources
  WorkPart work;        // of the pair's refinement
  uint32_t chunk = 0;   // number of the pair's link chunks already written
  uint32_t cycle = 0;   // of the balance within the receiver
};

struct SolveState {
  std::string basis;
  uint64_t seed = 0;
  double error = 0;          // requested
  uint64_t first_round = 0;  // index in `rounds` of the first for this request
  SolvePhase phase = SolvePhase::kRefine;
  uint32_t round = 0;
  double tau = 0;             // W/m
  double mean_reflected = 0;  // W/m2; from the round before, or a guess
  double residual = 0;        // unsent over reflected flux
  bool converged = false;
  bool published_in_sweep = false;
  uint32_t next_cell = 0;
  PairCursor cursor;
  uint64_t tick = 0;
  uint32_t sweeps_in_round = 0;
  uint64_t sweeps = 0;
  uint64_t rays = 0;
  std::vector<RoundRecord> rounds;
  std::vector<CellRow> cells;  // indexed by CellId
  SolveTimes times;
};

void SaveSolveState(const SolveState& state, BlockStorage& store);

// Returns false if the store has no state. Throws DamagedStoreError if the
// state cannot be read.
bool LoadSolveState(const BlockStorage& store, SolveState* state);

// Throws DamagedStoreError unless the state has so many cells.
void RequireSense(const SolveState& state, size_t cells);

}  // namespace enfilade
