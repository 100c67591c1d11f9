// The least memory that a solve needs, computed before the solve begins: what
// its largest subproblem must hold in memory at once, with everything else
// evicted.
//
//   subproblem                     in memory at once
//   covers of a receiver           its geometry, tree, blockers
//   refinement of a pair           geometry and tree of both, the receiver's
//                                  clusters, what the source sends at most,
//                                  the blockers of both and of the few
//                                  largest of the cells between them
//   balance within a cell          its geometry, tree, working arrays
//   any of them                    what the receiver sees
//
// Trees grow during refinement by a factor that cannot be known beforehand.
// There are therefore two caps. Under the first cap, the first rounds fit; a
// solve does not begin below it. Under the second cap, the solve should reach
// its end: it assumes trees as large as other solves have needed at the same
// error. Between the two caps a solve may have to stop and then names a larger
// cap.

#pragma once

#include "base/block_storage.h"
#include "base/ids.h"
#include "base/memory.h"
#include "solver/solve.h"

#include <cstdint>

namespace enfilade {

// Memory for links between refinement and the store: the results of a group,
// the pending links, and a chunk that is sorted, encoded and compressed.
// Charged while a cell is refined.
inline constexpr uint64_t kRefineWorkspaceBytes = 8ULL << 20;
// Memory for a chunk that is being read from the store. Charged as long as a
// solve runs.
inline constexpr uint64_t kSolveWorkspaceBytes = 2ULL << 20;

// Charged per cell as long as a solve runs: what is known of the cell without
// paging it in, and two more copies during a commit.
inline constexpr uint64_t kSolveBytesPerCell = 400;

// The size that the tree of a cell may grow to: a number of elements per patch,
// plus `extra` elements for large surfaces, which even a cell with few patches
// may have (docs/decisions/least-memory.md).
struct TreeGrowth {
  double with_lamps = 0;     // elements per patch, cell with lamps
  double without_lamps = 0;  // elements per patch, other cell
  double extra = 0;
};

// The growth during the first rounds.
inline constexpr TreeGrowth kFirstGrowth{1.25, 1.25, 8000};

// The growth by the end of a solve with this error and basis; at least
// kFirstGrowth.
TreeGrowth LastGrowth(const SolveOptions& options);

struct LeastMemory {
  uint64_t budget_bytes = 0;  // work space included
  uint64_t cap_bytes = 0;     // of the process, whole MiB
  // The two cells of the subproblem that needs the most; equal if the
  // subproblem has one cell.
  CellId receiver;
  CellId source;
  uint64_t cells_between = 0;  // including both ends
  // True if the rays that measure the error need more than any subproblem.
  bool is_of_rays = false;
};

// The two caps of a solve, as above.
struct LeastMemories {
  LeastMemory first;  // with kFirstGrowth
  LeastMemory last;   // with LastGrowth
};

// Reads each cell's patches once and each visible set once; holds a few words
// per cell. A tree that the store already has counts with its actual size if
// that is larger. The store must have visible sets. Throws DoesNotFitError if
// the budget is too small even for this.
LeastMemories FindLeastMemory(const BlockStorage& store,
                              const SolveOptions& options,
                              MemoryBudget& budget);

// Throws DoesNotFitError if the budget is too small for the solve to begin. The
// error names a cap under which the solve should reach its end.
void RequireLeastMemory(const BlockStorage& store,
                        const SolveOptions& options,
                        MemoryBudget& budget);

}  // namespace enfilade
