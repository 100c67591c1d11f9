// A cell that receives light, as refinement sees it, and what errors on its
// elements count.

#pragma once

#include "base/ids.h"
#include "solver/elements/cell_care.h"
#include "solver/elements/geometry.h"
#include "solver/transfer/cluster_tree.h"

#include <cstdint>
#include <span>
#include <vector>

namespace enfilade {

// Black surfaces receive light too, for probes, but need less care. Errors on
// them count as if the surfaces had this reflectance, or that of the scene if
// it is darker in the mean.
inline constexpr float kLeastWeightReflectance = 0.1F;

// Everything is borrowed.
struct RefineReceiver {
  CellId id;
  // The part of the cell that may see the source.
  Box part = Box::Everything();
  std::span<const PatchGeometry> patches = {};
  // Of the elements at which refinement begins.
  const ClusterTree* clusters = nullptr;
  // By patch. Empty: 1 for all.
  std::span<const PatchCare> care = {};
  // Errors on patches that reflect less count as if they reflected this share.
  float least_reflectance = kLeastWeightReflectance;
  // The result of WeighReceiver, the same for all sources.
  std::span<const float> weights = {};
};

// The weight of errors on an element of a patch: reflectance, but at least
// `least_reflectance`, times root of area, times care.
float WeightOf(const PatchGeometry& patch,
               ElementFrame frame,
               float care,
               float least_reflectance);

// The care of a patch; 1 if `care` is empty.
float CareOf(std::span<const PatchCare> care, uint32_t patch);

// For each cluster of a receiver, the largest weight of errors on an element at
// which refinement begins. The receiver's own `weights` are not looked at.
std::vector<float> WeighReceiver(const RefineReceiver& receiver);

}  // namespace enfilade
