#include "solver/link_codes.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace enfilade {
namespace {

constexpr int kExponentBias = 127 - 47;
constexpr int kDroppedBits = 13;  // of the 23 fraction bits of a float
constexpr int kMostRoot = 15;

// The root whose square is nearest to a share of the largest coefficient.
int RootOf(float share) {
  const float wanted = std::clamp(share, 0.0F, 1.0F) * kMostRoot * kMostRoot;
  const int below = static_cast<int>(std::sqrt(wanted));
  const bool nearer_below =
      wanted - static_cast<float>(below * below) <
      static_cast<float>((below + 1) * (below + 1)) - wanted;
  return std::min(nearer_below ? below : below + 1, kMostRoot);
}

using RowRoots = std::array<int, kTransferNodes>;

// The largest coefficient of a row first.
RowRoots RootsOfRow(const float* row, float largest) {
  std::array<size_t, kTransferNodes> order{};
  std::iota(order.begin(), order.end(), size_t{0});
  std::stable_sort(order.begin(), order.end(), [row](size_t a, size_t b) {
    return row[a] > row[b];
  });
  RowRoots roots{};
  float missing = 0;
  for (const size_t i : order) {
    const float share = row[i] / largest;
    if (share > 0) {
      roots[i] = RootOf(share + missing);
      missing += share - static_cast<float>(roots[i] * roots[i]) /
                             (kMostRoot * kMostRoot);
    }
  }
  return roots;
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
  EncodedKernel encoded;
  encoded.sum =
      EncodeCoefficient(std::accumulate(kernel.begin(), kernel.end(), 0.0F));
  if (encoded.sum == 0) {
    return encoded;
  }
  const float largest = *std::max_element(kernel.begin(), kernel.end());
  for (size_t g = 0; g < kTransferNodes; ++g) {
    const size_t first = g * kTransferNodes;
    const RowRoots roots = RootsOfRow(&kernel[first], largest);
    for (size_t q = 0; q < kTransferNodes; q += 2) {
      encoded.shape[(first + q) / 2] =
          static_cast<uint8_t>(roots[q] | roots[q + 1] << 4);
    }
  }
  return encoded;
}

Kernel DecodeKernel(uint16_t sum, const KernelShape& shape) {
  std::array<int, 2 * std::tuple_size_v<KernelShape>> squares{};
  for (size_t i = 0; i < shape.size(); ++i) {
    const int low = shape[i] & 15;
    const int high = shape[i] >> 4;
    squares[2 * i] = low * low;
    squares[2 * i + 1] = high * high;
  }
  const int total = std::accumulate(squares.begin(), squares.end(), 0);
  const float scale =
      total > 0 ? DecodeCoefficient(sum) / static_cast<float>(total) : 0.0F;
  Kernel kernel;
  for (size_t i = 0; i < kernel.size(); ++i) {
    kernel[i] = scale * static_cast<float>(squares[i]);
  }
  return kernel;
}

}  // namespace enfilade
