#include "solver/refine/refine_receiver.h"

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

std::vector<float> WeighReceiver(const RefineReceiver& receiver) {
  std::vector<float> weights;
  weights.reserve(receiver.clusters->Items().size());
  for (const ClusterItem& item : receiver.clusters->Items()) {
    const PatchGeometry& patch = receiver.patches[item.patch];
    weights.push_back(WeightOf(patch,
                               FrameOfPath(patch.shape, item.path),
                               CareOf(receiver.care, item.patch),
                               receiver.least_reflectance));
  }
  return receiver.clusters->LargestOf(weights);
}

}  // namespace enfilade
