// The oracle: how wrong a transfer between two elements would be if it were one
// link. docs/decisions/0011-oracle.md has the measurements of its constants.

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
  float detail = 0;  // RMS of what children have beyond it, W/m2
};

// Estimated parts of the error on the receiver, W/m2 of irradiance.
struct Judgement {
  Kernel kernel{};
  bool near = false;
  float transfer = 0;        // mean irradiance if nothing were in between
  float receiver_error = 0;  // beyond the receiver's basis
  float source_error = 0;    // beyond the source's nodes
  float form_factor = 0;     // the largest of the points looked at
};

// The transfer alone: its kernel, and the mean form factor.
Judgement JudgeTransfer(const TransferEnd& receiver, const RadiantEnd& source);

// Adds the errors to a judged transfer, which takes as long again.
void JudgeErrors(const TransferEnd& receiver,
                 const RadiantEnd& source,
                 const Basis& basis,
                 Judgement* judgement);

// Both.
Judgement Judge(const TransferEnd& receiver,
                const RadiantEnd& source,
                const Basis& basis);

// Plain quadrature would be too crude for a link: the ends are close, or the
// receiver's horizon cuts the source.
bool IsNear(const TransferEnd& receiver, const TransferEnd& source);

// All of `end` lies behind (or in) the plane of the patch. Where the two face
// each other, what is nearer than kCoincidentM lies in it: the gap is closed to
// rays, and what the two sent each other in it would be told of twice, since
// rays from either pass the other.
bool IsBehind(const TransferEnd& end, const PatchGeometry& patch);

// An upper bound of the mean form factor, not far above it when the ends are
// far apart.
float FormFactorBound(const TransferEnd& receiver, const TransferEnd& source);

// Whose fault unknown visibility is: near 1 where it varies with the point of
// the receiver, near 0 where it varies with the point of the source. Splitting
// the wrong end would turn one error that is seen into many that are too small
// to be seen but add up. Bit g * kTransferNodes + q: node q is seen from g.
float ReceiverShare(uint16_t bits,
                    const TransferEnd& receiver,
                    const TransferEnd& source);

// The value at a point of the second-order function that has these values at
// the transfer nodes.
float SecondOrderAt(PatchShape shape,
                    UnitPoint at,
                    const std::array<float, kTransferNodes>& at_nodes);

}  // namespace enfilade
