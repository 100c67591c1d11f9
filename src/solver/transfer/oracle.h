// The oracle: estimates the error of a transfer between two elements if that
// transfer were a single link. docs/decisions/0011-oracle.md has the
// measurements of the oracle's constants.

#pragma once

#include "solver/elements/basis.h"
#include "solver/transfer/form_factor.h"

#include <array>
#include <cstdint>

namespace enfilade {

// The source's end of a transfer.
struct RadiantEnd {
  TransferEnd end;
  // At the transfer nodes, the largest channel of each, W/m2.
  std::array<float, kTransferNodes> radiosity{};
  float detail = 0;  // RMS of the children's radiosity beyond it, W/m2
};

// A transfer and the estimated parts of its error on the receiver, W/m2 of
// irradiance.
struct Judgement {
  Kernel kernel{};
  bool near = false;
  float transfer = 0;        // mean unoccluded irradiance
  float receiver_error = 0;  // beyond the receiver's basis
  float source_error = 0;    // beyond the source's nodes
  float form_factor = 0;     // mean; after JudgeErrors, the largest
};

// Computes the transfer alone: its kernel, its mean irradiance, and the mean
// form factor.
Judgement JudgeTransfer(const TransferEnd& receiver, const RadiantEnd& source);

// Adds the errors to a judged transfer; takes as long as JudgeTransfer.
void JudgeErrors(const TransferEnd& receiver,
                 const RadiantEnd& source,
                 const Basis& basis,
                 Judgement* judgement);

// JudgeTransfer, then JudgeErrors.
Judgement Judge(const TransferEnd& receiver,
                const RadiantEnd& source,
                const Basis& basis);

// Whether plain quadrature is too crude for a link because the ends are close
// or the receiver's horizon cuts the source.
bool IsNear(const TransferEnd& receiver, const TransferEnd& source);

// Whether all of `end` lies behind (or in) the plane of the patch. If the two
// face each other, points within kCoincidentM of the plane count as in the
// plane: no rays enter so narrow a gap, and light exchanged within the gap
// would be counted twice, since rays from either surface pass the other.
bool IsBehind(const TransferEnd& end, const PatchGeometry& patch);

// An upper bound of the mean form factor, fairly tight if the ends are far
// apart.
float FormFactorBound(const TransferEnd& receiver, const TransferEnd& source);

// The end to blame for partial visibility: near 1 if visibility varies with the
// point of the receiver, near 0 if it varies with the point of the source.
// Splitting the wrong end would turn one error that is seen into many that are
// too small to be seen but add up. Bit g * kTransferNodes + q: receiver node g
// sees source node q.
float ReceiverShare(uint16_t bits,
                    const TransferEnd& receiver,
                    const TransferEnd& source);

// The value at `at` of the second-order function whose values at the transfer
// nodes are `at_nodes`.
float SecondOrderAt(PatchShape shape,
                    UnitPoint at,
                    const std::array<float, kTransferNodes>& at_nodes);

}  // namespace enfilade
