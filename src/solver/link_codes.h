// How the coefficients of links are written down.
//
//   EncodeCoefficient   one coefficient, 16 bits: a float without sign
//   EncodeKernel        the 16 of a near link, 10 bytes: their sum as above,
//                       and 4 bits each (docs/decisions/link-size.md)
//   EncodeKernelFinely  the same, 18 bytes: 8 bits each

#pragma once

#include "solver/form_factor.h"

#include <array>
#include <bit>
#include <cstdint>

namespace enfilade {

// Six bits of exponent, ten of fraction: [2^-47, 2^17), relative error at most
// 2^-11; smaller values become zero, larger ones the largest.
uint16_t EncodeCoefficient(float value);

inline float DecodeCoefficient(uint16_t code) {
  constexpr uint32_t kBias = (127 - 47) << 10;
  const uint32_t bits = (code + kBias) << 13;
  return std::bit_cast<float>(code == 0 ? 0U : bits);
}

// The square roots of coefficients, in fifteenths of the largest root: byte i
// holds that of coefficient 2i in its low half, of 2i + 1 in its high half.
// Fine ones are in 255ths, 8 bits each, and take two shapes: one for the upper
// four bits, one for the lower.
using KernelShape = std::array<uint8_t, kTransferNodes * kTransferNodes / 2>;

struct EncodedKernel {
  uint16_t sum = 0;  // EncodeCoefficient of the sum of all
  KernelShape shape{};
  KernelShape rest{};  // fine: the lower halves
};

// Keeps the sum, zeros, and nearly the sums of rows: what rounding adds to a
// row with one coefficient it takes away with the next smaller one.
EncodedKernel EncodeKernel(const Kernel& kernel);
EncodedKernel EncodeKernelFinely(const Kernel& kernel);

// Both are given by the source's nodes: K_gq at [q][g].
KernelColumns DecodeKernel(uint16_t sum, const KernelShape& shape);
KernelColumns DecodeFineKernel(uint16_t sum,
                               const KernelShape& shape,
                               const KernelShape& rest);

}  // namespace enfilade
