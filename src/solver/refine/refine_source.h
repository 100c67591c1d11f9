// A cell that sends light, as refinement sees it.

#pragma once

#include "base/ids.h"
#include "solver/elements/geometry.h"
#include "solver/transfer/cluster_tree.h"
#include "solver/transfer/source_group.h"

#include <cstdint>
#include <span>

namespace enfilade {

// Bounds of what a cell sends: solver/refine/source_weights.h.
struct SourceWeights;

// Everything is borrowed. The tree of the cell is not part of it: most pairs of
// cells exchange so little that it is never looked at (PairWork).
struct RefineSource {
  CellId id;
  // The part of the cell that may see the receiver.
  Box part = Box::Everything();
  std::span<const PatchGeometry> patches = {};
  const ClusterTree* clusters = nullptr;  // of whole patches
  // Groups of patches that each count as one. Null: none.
  const SourceGroups* groups = nullptr;
  // The result of WeighSource.
  const SourceWeights* sent = nullptr;

  [[nodiscard]] bool InGroup(uint32_t patch) const {
    return groups != nullptr && groups->Holds(patch);
  }
};

}  // namespace enfilade
