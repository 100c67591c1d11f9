// The oracles that estimate the error of a link of the hierarchical method:
// those of the study of 1997 and the solver's own. Each has its own unit, so
// equal epsilons do not mean equal work.
//
//   paper                            here
//   F (W, eq. 6; of its oracle)      FormFactorEstimate
//   form factor (Hanrahan et al.     kFormFactor: the larger of F_ij and F_ji
//   1991)
//   weighted by the radiosity it     kPower: A_i F_ij |B_j|, as a share of all
//   transfers (W, 2.4.3; "BFA")      power emitted; between flatlets the
//                                    largest of all pairs of boxes
//   |G^ - G| (Gortler et al. 1993,   kPolynomial: A_i |B_j| times the mean
//   Schroeder 1994)                  difference from the polynomial through the
//                                    nodes, likewise a share
//   the solver's own                 kTransfer: RMS of what the receiver's
//                                    basis cannot follow and of what the
//                                    source has beyond its nodes, times rho_i
//                                    (A_i / A)^1/2, over the emitted power per
//                                    area of all
//
// |B| is the mean of the channels, as W's brightness; kTransfer takes the
// largest channel of each node.

#pragma once

#include "solver/elements/basis.h"
#include "solver/reference/hierarchical_options.h"
#include "solver/transfer/node_transfer.h"

#include <array>
#include <span>
#include <vector>

namespace enfilade {

// A link as the oracle sees it.
struct CandidateLink {
  const NodeEnd& receiver;
  const NodeEnd& source;
  std::span<const float> radiosity;  // of the source, [channel][node], W/m2
  float detail = 0;                  // what the source's children add
};

struct LinkError {
  float error = 0;
  bool source_is_worse = false;  // the source is to be split
};

// W's eq. 6 with both heights raised to half the diameter of the larger end, so
// that the estimate is above 0 wherever light may pass; at most 1.
float FormFactorEstimate(const TransferEnd& receiver,
                         const TransferEnd& source);

class HierarchicalOracle {
 public:
  // The light of the whole scene, to which errors are relative.
  struct Light {
    double emitted_power = 0;  // W, mean of the channels
    double area = 0;           // of all patches, m2
  };

  // The basis is borrowed.
  HierarchicalOracle(OracleKind kind, const Basis& basis, Light light);

  [[nodiscard]] LinkError Error(const CandidateLink& link) const;

 private:
  // The values of the functions of all nodes, at each test point of a shape.
  using TestValues = std::vector<std::array<float, kMaxNodes>>;

  static TestValues ValuesOf(const ShapeBasis& basis);

  [[nodiscard]] float FormFactorError(const CandidateLink& link) const;
  [[nodiscard]] float PowerError(const CandidateLink& link) const;
  [[nodiscard]] float PolynomialError(const CandidateLink& link) const;
  [[nodiscard]] LinkError TransferError(const CandidateLink& link) const;

  OracleKind kind_;
  const Basis& basis_;
  Light light_;
  Basis polynomials_;                // in nodal form, of the same order
  std::array<TestValues, 2> tests_;  // by shape
};

}  // namespace enfilade
