#include "solver/state/held_gain.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>

namespace enfilade {
namespace {

// The largest product of reflectance and gain at the levels before kFirmHold,
// and the factor by which each level beyond kFirmHold lowers that product.
constexpr std::array<float, kFirmHold - 1> kMostReflected = {1.5F, 1.2F};
constexpr float kBeyondFirm = 0.7F;

// The gains at the nodes of all leaves, with the gains of their ancestors
// pushed down. The values at inner elements are meaningless.
CoefficientArray GainsOfLeaves(const CellTree& tree,
                               CoefficientArray gain,
                               std::span<const PatchGeometry> patches) {
  const TreeShape shape{tree.Shape().basis, 1};
  std::vector<float> pushed(shape.Stride());
  for (size_t i = 0; i < tree.Size(); ++i) {
    const Element& e = tree.At(ElementId(i));
    if (e.first_child == 0) {
      continue;
    }
    const ShapeBasis& basis = shape.basis->On(patches[e.patch].shape);
    for (size_t c = 0; c < kChildren; ++c) {
      PushTo(basis, shape, c, gain[ElementId(i)], pushed);
      const auto child = gain[ElementId(e.first_child + c)];
      std::transform(child.begin(),
                     child.end(),
                     pushed.begin(),
                     child.begin(),
                     std::plus<>());
    }
  }
  return gain;
}

float MostReflected(HoldLevel level, float reflectance) {
  if (level < kFirmHold) {
    return kMostReflected[level - 1];
  }
  return 0.5F * (1 + reflectance) *
         std::pow(kBeyondFirm, static_cast<float>(level - kFirmHold));
}

}  // namespace

CoefficientArray HeldShares(const CellTree& tree,
                            const CoefficientArray& gain,
                            std::span<const PatchGeometry> patches,
                            HoldLevel level) {
  if (level == 0) {
    return CoefficientArray(tree.Shape().NodeStride());
  }
  CoefficientArray shares = GainsOfLeaves(tree, gain, patches);
  for (size_t i = 0; i < tree.Size(); ++i) {
    const float rho = patches[tree.At(ElementId(i)).patch].max_reflectance;
    const float most = MostReflected(level, rho);
    for (float& share : shares[ElementId(i)]) {
      share = rho * share > most ? most / (rho * share) : 1.0F;
    }
  }
  return shares;
}

uint64_t HeldSharesBytesFor(size_t elements, TreeShape shape) {
  return elements * shape.NodeStride() * sizeof(float);
}

uint64_t HeldSharesBytes(const CoefficientArray& gain, HoldLevel level) {
  return level == 0 ? 0 : gain.SizeBytes();
}

}  // namespace enfilade
