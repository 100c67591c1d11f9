// The oracle: how wrong a transfer between two elements would be if it were one
// link. docs/decisions/0011-oracle.md has the measurements of its constants.

#pragma once

#include "solver/elements/basis.h"
#include "solver/transfer/form_factor.h"

#include <array>
#include <cstdint>
#include <span>

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

// The rest is what this oracle shares with others, as that of groups
// (group_transfer.h).

// Where the receiver's basis is tested: the middle, and near each edge.
std::span<const UnitPoint> TestPoints(PatchShape shape);

// Where the plane of the source cuts the receiver, what is lit may be a corner
// that neither nodes nor test points lie in: a ninth of a triangle, on which
// irradiance rises from nothing. The mean square of such light over the
// element, per square of what the corner gets.
inline constexpr float kCornerShare = 0.1F;

// The corner of an element that lies farthest along a direction, a little off
// its rim.
UnitPoint CornerAlong(const TransferEnd& end, Vec3f direction);

// The point of an element that is nearest to p, a little off its rim.
UnitPoint NearestOn(const TransferEnd& end, Vec3f p);

// The value at a point of the second-order function that has these values at
// the transfer nodes.
float SecondOrderAt(PatchShape shape,
                    UnitPoint at,
                    const std::array<float, kTransferNodes>& at_nodes);

// The RMS over an element of what the basis cannot follow, per RMS at the test
// points.
float ResidualScale(const Basis& basis);

}  // namespace enfilade
