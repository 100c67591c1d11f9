// What all steps of a solve share: what is known of the building, what of it is
// in memory, and how far the solve is.

#pragma once

#include "base/block_storage.h"
#include "base/ids.h"
#include "base/memory.h"
#include "partition/partition.h"
#include "scene/scene_store.h"
#include "solver/elements/element_tree.h"
#include "solver/elements/push_pull.h"
#include "solver/links/link_store.h"
#include "solver/paging/cell_pager.h"
#include "solver/refine/refine_receiver.h"
#include "solver/solve.h"
#include "solver/state/solve_state.h"
#include "visibility/occlusion.h"

#include <cstdint>
#include <type_traits>

namespace enfilade {

// Sums over all patches of the building.
struct PatchTotals {
  double count = 0;
  double emitted = 0;           // W, mean of the channels
  double receiving_area = 0;    // m2
  double reflecting_area = 0;   // of these, m2
  double reflectance_area = 0;  // integral of the mean reflectance, m2
};

// What the error is a mean over.
struct MeasuredSurface {
  explicit MeasuredSurface(const PatchTotals& totals);

  // True if nothing reflects: the solve is then for the irradiance, and
  // measures its error as if all surfaces had kLeastWeightReflectance.
  bool is_black;
  double area;  // m2, of the patches that reflect, or else of all that receive
  float
      least_reflectance;  // RefineReceiver::least_reflectance of all receivers
};

struct SolveContext {
  // Reads scene and partition, and the state if the store has one; otherwise
  // the state has all cells, with their areas and lamps alone.
  SolveContext(BlockStorage& of_store,
               const SolveOptions& of_solve,
               MemoryBudget& of_memory);

  // Whether the cell sends more than a vanishing share of the mean reflected
  // radiosity.
  [[nodiscard]] bool IsLit(CellId cell) const;

  // The seed of what is drawn in this round.
  [[nodiscard]] uint64_t SeedOfRound() const;

  // Runs `read`, and records its bytes as data that a cell's turn reads only
  // once.
  template <typename Read>
  auto ReadOnce(const Read& read) {
    const uint64_t before = store.Stats().bytes_read;
    const auto note = [&] {
      pager.Items().Trace().AddReadOnce(store.Stats().bytes_read - before);
    };
    if constexpr (std::is_void_v<decltype(read())>) {
      read();
      note();
    } else {
      auto result = read();
      note();
      return result;
    }
  }

  BlockStorage& store;
  const SolveOptions options;
  MemoryBudget& budget;

  const SceneInfo scene;
  const MemoryCharge scene_charge;
  GrowingCharge portals_charge;
  const Partition partition;
  const MemoryCharge cells_charge;
  const Basis basis;
  const TreeShape shape;
  const SurfaceTable surfaces;
  const OcclusionDevice device;
  CellPager pager;
  ChunkWriter chunks;  // tells the pager of what it has written
  SolveState state;
  const PatchTotals totals;
  const MeasuredSurface surface;
  const bool is_resumed;  // the state is the store's
};

}  // namespace enfilade
