#include "solver/held_gain.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>

namespace enfilade {
namespace {

// The largest product of reflectance and gain at the first levels, and what
// each level beyond the firm one leaves of it.
constexpr std::array<float, kFirmHold - 1> kMostReflected = {1.5F, 1.2F};
constexpr float kBeyondFirm = 0.7F;

// The gain of each leaf, mean over it: pushed down from its ancestors.
std::vector<float> GainsOfLeaves(const CellTree& tree,
                                 std::span<const PatchGeometry> patches) {
  const TreeShape shape{tree.Shape().basis, 1};
  CoefficientArray gain = tree.Gain();
  std::vector<float> pushed(shape.Stride());
  std::vector<float> means(tree.Size());
  for (size_t i = 0; i < tree.Size(); ++i) {
    const Element& e = tree.At(ElementId(i));
    const ShapeBasis& basis = shape.basis->On(patches[e.patch].shape);
    const auto own = gain[ElementId(i)];
    if (e.first_child == 0) {
      for (size_t q = 0; q < basis.NodeCount(); ++q) {
        means[i] += static_cast<float>(basis.Weight(q)) * own[q];
      }
      continue;
    }
    for (size_t c = 0; c < kChildren; ++c) {
      PushTo(basis, shape, c, own, pushed);
      const auto child = gain[ElementId(e.first_child + c)];
      std::transform(child.begin(),
                     child.end(),
                     pushed.begin(),
                     child.begin(),
                     std::plus<>());
    }
  }
  return means;
}

float MostReflected(HoldLevel level, float reflectance) {
  if (level < kFirmHold) {
    return kMostReflected[level - 1];
  }
  return 0.5F * (1 + reflectance) *
         std::pow(kBeyondFirm, static_cast<float>(level - kFirmHold));
}

}  // namespace

std::vector<float> HeldShares(const CellTree& tree,
                              std::span<const PatchGeometry> patches,
                              HoldLevel level) {
  std::vector<float> shares(tree.Size(), 1);
  if (level == 0) {
    return shares;
  }
  const std::vector<float> gains = GainsOfLeaves(tree, patches);
  for (size_t i = 0; i < tree.Size(); ++i) {
    const float rho = patches[tree.At(ElementId(i)).patch].max_reflectance;
    const float most = MostReflected(level, rho);
    shares[i] = rho * gains[i] > most ? most / (rho * gains[i]) : 1.0F;
  }
  return shares;
}

uint64_t HeldSharesBytesFor(size_t elements, TreeShape shape) {
  return elements * (2 + shape.NodeStride()) * sizeof(float);
}

uint64_t HeldSharesBytes(const CellTree& tree) {
  return tree.Size() * 2 * sizeof(float) + tree.Gain().SizeBytes();
}

}  // namespace enfilade
