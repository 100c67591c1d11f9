// A cell as refinement sees it, as a receiver and as a source: its patches, and
// what they weigh at most by clusters, for bounds.

#pragma once

#include "base/ids.h"
#include "solver/elements/cell_care.h"
#include "solver/elements/element_tree.h"
#include "solver/elements/geometry.h"
#include "solver/transfer/cluster_tree.h"
#include "solver/transfer/source_group.h"

#include <cstdint>
#include <span>
#include <vector>

namespace enfilade {

// Black surfaces receive too, for probes, but need less care: errors on them
// count as if they had this reflectance.
inline constexpr float kLeastWeightReflectance = 0.1F;

// What a cell sends at most: solver/refine/source_weights.h.
struct SourceWeights;

struct RefineOptions {
  double tau = 1;                // W/m: largest weighted error of a link
  double tau_weak = 1;           // W/m: transfers below are sampled
  uint64_t seed = 0;             // of the visibility samples
  float least_diameter = 2e-5F;  // m; smaller elements are not split
  bool counts_black = false;     // errors on surfaces that reflect nothing
};

struct RefineSide {
  CellId id;
  // Nothing outside of it sees anything of the other side.
  Box part = Box::Everything();
  std::span<const PatchGeometry> patches = {};
  const CellTree* tree = nullptr;
  // Of the elements at which refinement begins; whole patches for the source.
  const ClusterTree* clusters = nullptr;
  // Of the source: patches that count as one. Null: none.
  const SourceGroups* groups = nullptr;
  // Of the receiver, by patch. Empty: 1 for all.
  std::span<const PatchCare> care = {};
  // Of the receiver: its ReceiverWeights, the same for all sources.
  std::span<const float> weights = {};
  // Of the source: what WeighSource says.
  const SourceWeights* sent = nullptr;

  [[nodiscard]] bool InGroup(uint32_t patch) const {
    return groups != nullptr && groups->Holds(patch);
  }
};

// How much errors weigh on an element of a patch: reflectance times root of
// area, times care.
float WeightOf(const PatchGeometry& patch, ElementFrame frame, float care);

// The care of a patch, of none where there is nothing said.
float CareOf(std::span<const PatchCare> care, uint32_t patch);

// By cluster of a receiver cell, how much errors weigh at most on an element at
// which refinement begins.
std::vector<float> ReceiverWeights(std::span<const PatchGeometry> patches,
                                   const ClusterTree& clusters,
                                   std::span<const PatchCare> care);

}  // namespace enfilade
