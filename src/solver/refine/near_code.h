// What a near link keeps of its kernel, and how much of the light that loses.

#pragma once

#include "solver/links/link_codes.h"
#include "solver/transfer/form_factor.h"
#include "solver/transfer/oracle.h"

#include <cstdint>
#include <optional>

namespace enfilade {

struct NearCode {
  uint16_t sum = 0;  // EncodeSum of the kernel
  // By how much the irradiance is off if the kernel is rebuilt as plain
  // quadrature between the visible pairs of nodes, scaled to the sum, W/m2, RMS
  // over the receiver's nodes. Nullopt if this quadrature is zero everywhere,
  // so that it cannot be scaled.
  std::optional<float> error;
};

// `kernel` is zero where bit (g * kTransferNodes + q) of `visible` is not set.
NearCode EncodeNear(const TransferEnd& receiver,
                    const RadiantEnd& source,
                    const Kernel& kernel,
                    uint16_t visible);

}  // namespace enfilade
