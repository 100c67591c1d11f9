// A cell as refinement sees it, as a receiver or as a source: its patches, and,
// for bounds, the largest weights of its clusters.

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

// Black surfaces receive light too, for probes, but need less care. Errors on
// them count as if the surfaces had this reflectance, or that of the scene if
// it is darker in the mean.
inline constexpr float kLeastWeightReflectance = 0.1F;

// Bounds of what a cell sends: solver/refine/source_weights.h.
struct SourceWeights;

struct RefineOptions {
  double tau = 1;                // W/m: largest weighted error of a link
  double tau_weak = 1;           // W/m: smaller transfers are sampled
  uint64_t seed = 0;             // of the visibility samples
  float least_diameter = 2e-5F;  // m; smaller elements are not split
  bool counts_black = false;     // count errors on black surfaces
};

struct RefineSide {
  CellId id;
  // The part of the cell that may see the other side.
  Box part = Box::Everything();
  std::span<const PatchGeometry> patches = {};
  const CellTree* tree = nullptr;
  // The clusters of the elements at which refinement begins; for the source,
  // these are whole patches.
  const ClusterTree* clusters = nullptr;
  // For the source: groups of patches that each count as one. Null: none.
  const SourceGroups* groups = nullptr;
  // For the receiver: the care by patch. Empty: 1 for all.
  std::span<const PatchCare> care = {};
  // For the receiver: errors on patches that reflect less count as if they
  // reflected this share.
  float least_reflectance = kLeastWeightReflectance;
  // For the receiver: its ReceiverWeights, the same for all sources.
  std::span<const float> weights = {};
  // For the source: the result of WeighSource.
  const SourceWeights* sent = nullptr;

  [[nodiscard]] bool InGroup(uint32_t patch) const {
    return groups != nullptr && groups->Holds(patch);
  }
};

// The weight of errors on an element of a patch: reflectance, but at least
// `least_reflectance`, times root of area, times care.
float WeightOf(const PatchGeometry& patch,
               ElementFrame frame,
               float care,
               float least_reflectance);

// The care of a patch; 1 if `care` is empty.
float CareOf(std::span<const PatchCare> care, uint32_t patch);

// For each cluster of a receiver cell, the largest weight of errors on an
// element at which refinement begins. Takes patches, clusters, care and the
// least reflectance of the side.
std::vector<float> ReceiverWeights(const RefineSide& side);

}  // namespace enfilade
