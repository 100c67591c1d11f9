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

using Row = std::array<uint32_t, kTransferNodes>;

// By receiver node, the four bits of each source node from the lowest on.
Row RowsOf(const KernelShape& shape) {
  Row rows{};
  for (size_t g = 0; g < rows.size(); ++g) {
    rows[g] = shape[2 * g] | uint32_t{shape[2 * g + 1]} << 8;
  }
  return rows;
}

Row RootsAt(const Row& rows, size_t q) {
  Row roots{};
  for (size_t g = 0; g < rows.size(); ++g) {
    roots[g] = rows[g] >> (4 * q) & 15;
  }
  return roots;
}

// Squares of roots, and their sum, are whole numbers that floats hold exactly.
void SetSquares(const Row& roots, std::array<float, kTransferNodes>* column) {
  for (size_t g = 0; g < roots.size(); ++g) {
    const auto root = static_cast<float>(static_cast<int32_t>(roots[g]));
    (*column)[g] = root * root;
  }
}

// Makes squares coefficients of this sum.
void Scale(uint16_t sum, KernelColumns* squares) {
  std::array<float, kTransferNodes> totals{};
  for (const auto& column : *squares) {
    for (size_t g = 0; g < column.size(); ++g) {
      totals[g] += column[g];
    }
  }
  const float total = (totals[0] + totals[1]) + (totals[2] + totals[3]);
  const float scale = total > 0 ? DecodeCoefficient(sum) / total : 0.0F;
  for (auto& column : *squares) {
    for (float& square : column) {
      square *= scale;
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

EncodedKernel EncodeKernel(const Kernel& kernel) {
  return {SumOf(kernel), Packed(RootsOf(kernel, kMostRoot), 0), {}};
}

EncodedKernel EncodeKernelFinely(const Kernel& kernel) {
  const Roots roots = RootsOf(kernel, kMostFineRoot);
  return {SumOf(kernel), Packed(roots, 4), Packed(roots, 0)};
}

KernelColumns DecodeKernel(uint16_t sum, const KernelShape& shape) {
  const Row rows = RowsOf(shape);
  KernelColumns columns;
  for (size_t q = 0; q < columns.size(); ++q) {
    SetSquares(RootsAt(rows, q), &columns[q]);
  }
  Scale(sum, &columns);
  return columns;
}

KernelColumns DecodeFineKernel(uint16_t sum,
                               const KernelShape& shape,
                               const KernelShape& rest) {
  const Row high = RowsOf(shape);
  const Row low = RowsOf(rest);
  KernelColumns columns;
  for (size_t q = 0; q < columns.size(); ++q) {
    Row roots = RootsAt(high, q);
    const Row lower = RootsAt(low, q);
    for (size_t g = 0; g < roots.size(); ++g) {
      roots[g] = roots[g] << 4 | lower[g];
    }
    SetSquares(roots, &columns[q]);
  }
  Scale(sum, &columns);
  return columns;
}

}  // namespace enfilade
