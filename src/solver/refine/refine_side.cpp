#include "solver/refine/refine_side.h"

#include <algorithm>
#include <cmath>

namespace enfilade {

float WeightOf(const PatchGeometry& patch,
               ElementFrame frame,
               float care,
               float least_reflectance) {
  return care * std::max(patch.max_reflectance, least_reflectance) *
         std::sqrt(AreaOf(patch, frame));
}

float CareOf(std::span<const PatchCare> care, uint32_t patch) {
  return care.empty() ? 1.0F : care[patch].care;
}

std::vector<float> ReceiverWeights(const RefineSide& side) {
  std::vector<float> weights;
  weights.reserve(side.clusters->Items().size());
  for (const ClusterItem& item : side.clusters->Items()) {
    const PatchGeometry& patch = side.patches[item.patch];
    weights.push_back(WeightOf(patch,
                               FrameOfPath(patch.shape, item.path),
                               CareOf(side.care, item.patch),
                               side.least_reflectance));
  }
  return side.clusters->LargestOf(weights);
}

}  // namespace enfilade
