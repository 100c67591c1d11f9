// The state of a solve between two commits: where it stands in its schedule,
// and a row per cell. Everything that decides how the solve goes on is here or
// in the trees and links, so that a resumed solve takes the same steps.

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

// What the solve knows of a cell without paging it in.
struct CellRow {
  // Ticks of the schedule's clock; 0: never.
  uint64_t published = 0;    // when `delta` was last changed
  uint64_t processed = 0;    // when it last took in the deltas of others
  double reflected = 0;      // integral of rho H, mean of the channels, W
  double residual = 0;       // integral of |radiosity not yet sent|, W
  double changed = 0;        // integral of (change in this round)^2, W^2/m2
  double squared_error = 0;  // of this round's links, (W/m)^2
  double area = 0;           // of its patches that receive light, m2
  double radius = 0.5;       // of the transport within it (semi_iteration.h)
  double most_radius = 1;    // limit of `radius`; above it, light grew
  float peak = 0;            // largest |radiosity|, W/m2; 0: dark
  HoldLevel hold = 0;        // of its gains
  uint64_t elements = 0;
  uint64_t links = 0;
  uint64_t lit_late_in = 0;  // the last round, from 1, in which others had
                             // passed it when it was lit; 0: none
};

template <>
inline constexpr bool kIsPacked<CellRow> = sizeof(CellRow) ==
                                           5 * sizeof(uint64_t) +
                                               7 * sizeof(double) +
                                               sizeof(float) +
                                               sizeof(HoldLevel);

enum class SolvePhase : uint8_t { kRefine = 0, kPropagate = 1, kDone = 2 };

// One refinement round, finished.
struct RoundRecord {
  double tau = 0;
  double predicted_error = 0;  // from the oracle, relative
  double observed_change = 0;  // against the round before, relative
  double residual_error = 0;   // measured by rays, relative; 0: it was not
  // The upper end of what they say with 95 % certainty.
  double most_by_rays = 0;
  double estimated_error = 0;
  // Share of the squared error seen by rays that care alone will remove, at the
  // same tau.
  double cared_for = 0;
  // What cells reflect that were lit only after the links from them should have
  // been made, over what all do.
  double late = 0;
  uint64_t links = 0;
};

// Time spent and bytes asked for, over all runs: kept apart because they are
// not the same twice. Bytes are those of finished rounds, and of one in which
// the solve was asked to stop.
struct SolveTimes {
  double refine_seconds = 0;
  double gather_seconds = 0;
  double push_pull_seconds = 0;
  double store_seconds = 0;
  uint64_t bytes_read = 0;  // by the rounds: not by rays for the residual
  uint64_t bytes_belady = 0;
  uint64_t bytes_compulsory = 0;
};

// Where within a receiver the next step is.
struct PairCursor {
  uint32_t source = 0;  // index into the receiver's list of sources
  WorkPart work;        // of the pair's refinement
  uint32_t chunk = 0;   // link chunks of the pair that are written
  uint32_t cycle = 0;   // of the balance within the receiver
};

struct SolveState {
  std::string basis;
  uint64_t seed = 0;
  double error = 0;          // requested
  uint64_t first_round = 0;  // of `rounds`, for that request
  SolvePhase phase = SolvePhase::kRefine;
  uint32_t round = 0;
  double tau = 0;             // W/m
  double mean_reflected = 0;  // W/m2; of the round before, or a guess
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

// False if the store has none. DamagedStoreError if it cannot be read.
bool LoadSolveState(const BlockStorage& store, SolveState* state);

// Throws DamagedStoreError unless the state is of so many cells.
void RequireSense(const SolveState& state, size_t cells);

}  // namespace enfilade
