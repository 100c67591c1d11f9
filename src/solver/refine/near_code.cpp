#include "solver/refine/near_code.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace enfilade {
namespace {

// The QuadratureKernel of the visible pairs of nodes, scaled to a sum.
Kernel ScaledQuadrature(const TransferEnd& receiver,
                        const TransferEnd& source,
                        uint16_t visible,
                        uint16_t sum) {
  Kernel kernel = QuadratureKernel(receiver, source);
  MaskKernel(visible, &kernel);
  std::array<float, kTransferNodes> totals{};
  for (size_t i = 0; i < kernel.size(); ++i) {
    totals[i / kTransferNodes] += kernel[i];
  }
  const float scale = ScaleTo(sum, totals);
  for (float& k : kernel) {
    k *= scale;
  }
  return kernel;
}

bool IsZero(const Kernel& kernel) {
  return std::all_of(
      kernel.begin(), kernel.end(), [](float k) { return k == 0; });
}

// The difference between the irradiances that two kernels bring from a source
// with these nodes and this detail, W/m2, RMS over the receiver.
float Difference(const Kernel& kernel,
                 const Kernel& other,
                 const TransferEnd& receiver,
                 const RadiantEnd& source) {
  float square = 0;
  for (size_t g = 0; g < kTransferNodes; ++g) {
    float even = 0;
    float uneven = 0;
    for (size_t q = 0; q < kTransferNodes; ++q) {
      const size_t i = g * kTransferNodes + q;
      const float off = other[i] - kernel[i];
      even += off * source.radiosity[q];
      uneven += off * off;
    }
    square += receiver.nodes.weight[g] *
              (even * even + uneven * source.detail * source.detail);
  }
  return std::sqrt(square);
}

}  // namespace

NearCode EncodeNear(const TransferEnd& receiver,
                    const RadiantEnd& source,
                    const Kernel& kernel,
                    uint16_t visible) {
  NearCode code{EncodeSum(kernel), {}};
  const Kernel rebuilt =
      ScaledQuadrature(receiver, source.end, visible, code.sum);
  if (!IsZero(rebuilt)) {
    code.error = Difference(kernel, rebuilt, receiver, source);
  }
  return code;
}

}  // namespace enfilade
