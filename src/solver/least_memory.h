// The least memory that a solve can do with, known before it begins: what its
// largest subproblem must have in memory at once, whatever else is evicted.
//
//   subproblem                     in memory at once
//   covers of a receiver           its geometry, tree, blockers
//   refinement of a pair           geometry and tree of both, the receiver's
//                                  clusters, what the source sends at most,
//                                  the blockers of every cell between them
//   balance within a cell          its geometry, tree, working arrays
//   any of them                    what the receiver sees
//
// Trees grow while elements are refined, by a factor that nobody knows
// beforehand. So there are two caps: one under which the first rounds fit,
// below which a solve does not begin, and one for trees as large as those of
// other solves have become at the same error, under which it should end.
// Between the two a solve may have to stop, and then names a larger cap.

#pragma once

#include "base/block_storage.h"
#include "base/ids.h"
#include "base/memory.h"
#include "solver/solve.h"

#include <cstdint>

namespace enfilade {

// Links on their way from refinement to the store: the results of a group, what
// is pending, a chunk sorted, encoded and compressed. Charged while a cell is
// refined.
inline constexpr uint64_t kRefineWorkspaceBytes = 8ULL << 20;
// A chunk on its way from the store. Charged as long as a solve runs.
inline constexpr uint64_t kSolveWorkspaceBytes = 2ULL << 20;

// Of each cell as long as a solve runs: what is known of it without paging it
// in, twice more while that is committed.
inline constexpr uint64_t kSolveBytesPerCell = 400;

// What the tree of a cell may grow to: so many elements per patch, and some for
// the large surfaces, however few (docs/decisions/least-memory.md).
struct TreeGrowth {
  double with_lamps = 0;     // per patch of a cell with lamps
  double without_lamps = 0;  // per patch of another
  double extra = 0;
};

// In the first rounds.
inline constexpr TreeGrowth kFirstGrowth{1.25, 1.25, 8000};

// By the end of a solve with this error and basis: no less.
TreeGrowth LastGrowth(const SolveOptions& options);

struct LeastMemory {
  uint64_t budget_bytes = 0;  // work space included
  uint64_t cap_bytes = 0;     // of the process, whole MiB
  // The subproblem that needs it; equal where one cell is alone.
  CellId receiver;
  CellId source;
  uint64_t cells_between = 0;  // both ends included
  // No subproblem needs as much as the rays that measure the error.
  bool is_of_rays = false;
};

// Reads each cell's patches once and each visible set once; holds a few words
// per cell. Trees that are there already count as they are, if they are larger.
// The store must have visible sets.
LeastMemory FindLeastMemory(const BlockStorage& store,
                            const SolveOptions& options,
                            const TreeGrowth& growth);

// Throws DoesNotFitError, which names a cap under which the solve should end,
// if the budget is too small for it to begin.
void RequireLeastMemory(const BlockStorage& store,
                        const SolveOptions& options,
                        const MemoryBudget& budget);

}  // namespace enfilade
