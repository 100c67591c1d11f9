#include "solver/refine/refine_side.h"

#include <algorithm>
#include <cmath>

namespace enfilade {
float WeightOf(const PatchGeometry& patch, ElementFrame frame, float care) {
  return care * std::max(patch.max_reflectance, kLeastWeightReflectance) *
         std::sqrt(AreaOf(patch, frame));
}

float CareOf(std::span<const PatchCare> care, uint32_t patch) {
  return care.empty() ? 1.0F : care[patch].care;
}

std::vector<float> ReceiverWeights(std::span<const PatchGeometry> patches,
                                   const ClusterTree& clusters,
                                   std::span<const PatchCare> care) {
  std::vector<float> weights;
  weights.reserve(clusters.Items().size());
  for (const ClusterItem& item : clusters.Items()) {
    const PatchGeometry& patch = patches[item.patch];
    weights.push_back(WeightOf(
        patch, FrameOfPath(patch.shape, item.path), CareOf(care, item.patch)));
  }
  return clusters.LargestOf(weights);
}

}  // namespace enfilade
