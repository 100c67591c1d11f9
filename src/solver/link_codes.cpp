#include "solver/link_codes.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace enfilade {
namespace {

constexpr int kExponentBias = 127 - 47;
constexpr int kDroppedBits = 13;  // of the 23 fraction bits of a float
constexpr int kMostRoot = 15;
constexpr int kMostFineRoot = 255;

// The root, up to `most`, whose square is nearest to a share of the largest
// coefficient.
int RootOf(float share, int most) {
  const float wanted =
      std::clamp(share, 0.0F, 1.0F) * static_cast<float>(most * most);
  const int below = static_cast<int>(std::sqrt(wanted));
  const int above = below + 1;
  const bool nearer_below = wanted - static_cast<float>(below * below) <
                            static_cast<float>(above * above) - wanted;
  return std::min(nearer_below ? below : above, most);
}

using Roots = std::array<int, kTransferNodes * kTransferNodes>;

// The places of a row from its largest coefficient to its smallest, equal ones
// as they come. By insertion: std::stable_sort would ask for memory.
std::array<size_t, kTransferNodes> FallingOrder(const float* row) {
  std::array<size_t, kTransferNodes> order{};
  for (size_t i = 0; i < order.size(); ++i) {
    size_t at = i;
    for (; at > 0 && row[i] > row[order[at - 1]]; --at) {
      order[at] = order[at - 1];
    }
    order[at] = i;
  }
  return order;
}

// The roots of a row, that of its largest coefficient first.
void FindRoots(const float* row, float largest, int most, int* roots) {
  const auto order = FallingOrder(row);
  float missing = 0;
  for (const size_t i : order) {
    const float share = row[i] / largest;
    if (share > 0) {
      roots[i] = RootOf(share + missing, most);
      missing += share - static_cast<float>(roots[i] * roots[i]) /
                             static_cast<float>(most * most);
    }
  }
}

Roots RootsOf(const Kernel& kernel, int most) {
  Roots roots{};
  const float largest = *std::max_element(kernel.begin(), kernel.end());
  if (largest > 0) {
    for (size_t first = 0; first < kernel.size(); first += kTransferNodes) {
      FindRoots(&kernel[first], largest, most, &roots[first]);
    }
  }
  return roots;
}

uint16_t SumOf(const Kernel& kernel) {
  return EncodeCoefficient(std::accumulate(kernel.begin(), kernel.end(), 0.0F));
}

// Four bits of each root, from the bit `shift` on.
KernelShape Packed(const Roots& roots, int shift) {
  KernelShape shape{};
  for (size_t i = 0; i < shape.size(); ++i) {
    const int low = roots[2 * i] >> shift & 15;
    const int high = roots[2 * i + 1] >> shift & 15;
    shape[i] = static_cast<uint8_t>(low | high << 4);
  }
  return shape;
}

Roots Unpacked(const KernelShape& shape) {
  Roots roots{};
  for (size_t i = 0; i < shape.size(); ++i) {
    roots[2 * i] = shape[i] & 15;
    roots[2 * i + 1] = shape[i] >> 4;
  }
  return roots;
}

Kernel KernelOf(uint16_t sum, Roots roots) {
  for (int& root : roots) {
    root *= root;
  }
  const int total = std::accumulate(roots.begin(), roots.end(), 0);
  const float scale =
      total > 0 ? DecodeCoefficient(sum) / static_cast<float>(total) : 0.0F;
  Kernel kernel;
  for (size_t i = 0; i < kernel.size(); ++i) {
    kernel[i] = scale * static_cast<float>(roots[i]);
  }
  return kernel;
}

}  // namespace

uint16_t EncodeCoefficient(float value) {
  if (!(value > 0)) {
    return 0;
  }
  const uint32_t rounded =
      std::bit_cast<uint32_t>(value) + (1U << (kDroppedBits - 1));
  const int64_t code = static_cast<int64_t>(rounded >> kDroppedBits) -
                       (int64_t{kExponentBias} << (23 - kDroppedBits));
  return static_cast<uint16_t>(std::clamp<int64_t>(code, 0, 0xFFFF));
}

EncodedKernel EncodeKernel(const Kernel& kernel) {
  return {SumOf(kernel), Packed(RootsOf(kernel, kMostRoot), 0), {}};
}

EncodedKernel EncodeKernelFinely(const Kernel& kernel) {
  const Roots roots = RootsOf(kernel, kMostFineRoot);
  return {SumOf(kernel), Packed(roots, 4), Packed(roots, 0)};
}

Kernel DecodeKernel(uint16_t sum, const KernelShape& shape) {
  return KernelOf(sum, Unpacked(shape));
}

Kernel DecodeFineKernel(uint16_t sum,
                        const KernelShape& shape,
                        const KernelShape& rest) {
  Roots roots = Unpacked(shape);
  const Roots low = Unpacked(rest);
  for (size_t i = 0; i < roots.size(); ++i) {
    roots[i] = roots[i] << 4 | low[i];
  }
  return KernelOf(sum, roots);
}

}  // namespace enfilade
