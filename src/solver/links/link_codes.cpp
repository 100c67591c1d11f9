#include "solver/links/link_codes.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace enfilade {
namespace {

constexpr int kExponentBias = 127 - 47;
constexpr int kDroppedBits = 13;  // of the 23 fraction bits of a float
constexpr int kMostRoot = 255;

// The root in 0 to kMostRoot whose square is nearest to `share` of the largest
// square.
int RootOf(float share) {
  const float wanted =
      std::clamp(share, 0.0F, 1.0F) * static_cast<float>(kMostRoot * kMostRoot);
  const int below = static_cast<int>(std::sqrt(wanted));
  const int above = below + 1;
  const bool nearer_below = wanted - static_cast<float>(below * below) <
                            static_cast<float>(above * above) - wanted;
  return std::min(nearer_below ? below : above, kMostRoot);
}

// The indices of a row's coefficients in descending order, equal ones in their
// given order. Insertion sort, because std::stable_sort would allocate memory.
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

// Finds the roots of a row, beginning with its largest coefficient.
void FindRoots(const float* row, float largest, uint8_t* roots) {
  const auto order = FallingOrder(row);
  float missing = 0;
  for (const size_t i : order) {
    const float share = row[i] / largest;
    if (share > 0) {
      const int root = RootOf(share + missing);
      roots[i] = static_cast<uint8_t>(root);
      missing += share - static_cast<float>(root * root) /
                             static_cast<float>(kMostRoot * kMostRoot);
    }
  }
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

uint16_t EncodeSum(const Kernel& kernel) {
  return EncodeCoefficient(std::accumulate(kernel.begin(), kernel.end(), 0.0F));
}

EncodedKernel EncodeKernel(const Kernel& kernel) {
  EncodedKernel encoded;
  encoded.sum = EncodeSum(kernel);
  const float largest = *std::max_element(kernel.begin(), kernel.end());
  if (largest > 0) {
    for (size_t first = 0; first < kernel.size(); first += kTransferNodes) {
      FindRoots(&kernel[first], largest, &encoded.shape[first]);
    }
  }
  return encoded;
}

KernelColumns DecodeKernel(uint16_t sum, const KernelShape& shape) {
  // The squares of roots, and their sums, are whole numbers that floats hold
  // exactly.
  KernelColumns columns;
  std::array<float, kTransferNodes> totals{};
  for (size_t q = 0; q < columns.size(); ++q) {
    for (size_t g = 0; g < kTransferNodes; ++g) {
      const auto root = static_cast<float>(shape[g * kTransferNodes + q]);
      columns[q][g] = root * root;
      totals[g] += columns[q][g];
    }
  }
  const float scale = ScaleTo(sum, totals);
  for (auto& column : columns) {
    for (float& square : column) {
      square *= scale;
    }
  }
  return columns;
}

}  // namespace enfilade
