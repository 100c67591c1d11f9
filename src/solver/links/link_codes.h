// The encoding of the coefficients of links.
//
//   EncodeCoefficient   one coefficient, 16 bits: a float without sign
//   EncodeKernel        the 16 of a shaped link, 18 bytes: their sum as above,
//                       and 8 bits each (docs/decisions/link-size.md)

#pragma once

#include "solver/transfer/form_factor.h"

#include <array>
#include <bit>
#include <cstdint>

namespace enfilade {

// Six bits of exponent, ten of fraction: (2^-47, 2^17), relative error at most
// 2^-11; smaller values become zero, larger ones the largest.
uint16_t EncodeCoefficient(float value);

inline float DecodeCoefficient(uint16_t code) {
  constexpr uint32_t kBias = (127 - 47) << 10;
  const uint32_t bits = (code + kBias) << 13;
  return std::bit_cast<float>(code == 0 ? 0U : bits);
}

// The square roots of coefficients, in 255ths of the largest root.
using KernelShape = std::array<uint8_t, kTransferNodes * kTransferNodes>;

struct EncodedKernel {
  uint16_t sum = 0;  // EncodeSum
  KernelShape shape{};
};

// EncodeCoefficient of the sum of all.
uint16_t EncodeSum(const Kernel& kernel);

// Keeps the sum, zeros and, nearly, the sums of rows: the rounding error of one
// coefficient is carried over to the next smaller one of its row.
EncodedKernel EncodeKernel(const Kernel& kernel);

// The decoded kernel by the source's nodes: K_gq at [q][g].
KernelColumns DecodeKernel(uint16_t sum, const KernelShape& shape);

// The factor that scales coefficients with these totals (one per receiver node)
// to an encoded sum; zero if all totals are zero.
inline float ScaleTo(uint16_t sum,
                     const std::array<float, kTransferNodes>& totals) {
  static_assert(kTransferNodes == 4);
  const float total = (totals[0] + totals[1]) + (totals[2] + totals[3]);
  return total > 0 ? DecodeCoefficient(sum) / total : 0.0F;
}

}  // namespace enfilade
