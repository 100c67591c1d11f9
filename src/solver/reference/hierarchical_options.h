// What the hierarchical method of the study of 1997 can be told to do in more
// than one way: how visibility is found, what is done where the kernel is
// singular, and what decides that a link is good enough.
//
//   paper                       here
//   vis1 (W, 2.6)               VisibilityMode::kRay
//   vis16, fractional (2.4.2)   kFractional; with triage (2.4.3) kTriage
//   visibility in quadrature    kQuadrature
//   epsilon (W, 2.4)            epsilon; the unit depends on the oracle
//   polygon-to-point (W, 2.1)   SingularRule::kSwitch
//   C-C transfer (W, 2.4.2)     kFlatlets

#pragma once

#include "solver/elements/basis.h"
#include "solver/state/solve_options.h"

#include <cstdint>
#include <string>

namespace enfilade {

enum class VisibilityMode : uint8_t {
  kRay,         // one ray between the centers
  kFractional,  // the share of 16 jittered rays, for the whole link
  kTriage,      // likewise; none or all of them is so for all below as well
  kQuadrature,  // one ray for each pair of nodes
  kStratified,  // one ray for each pair of parts, random: the solver's own
};

enum class SingularRule : uint8_t {
  kNone,      // nothing: plain quadrature
  kSwitch,    // from centers to polygons where a source looks large
  kFlatlets,  // of touching ends, transfers between flatlets: C-C
  kNear,      // exact rows or columns of close ends: the solver's own
};

enum class OracleKind : uint8_t {
  kFormFactor,  // the larger form factor of both ends
  kPower,       // the power that goes over the link
  kPolynomial,  // how far the kernel is from a polynomial, times that power
  kTransfer,    // what the receiver gets beyond its basis: the solver's own
};

struct HierarchicalOptions {
  double epsilon = 0;
  VisibilityMode visibility = VisibilityMode::kTriage;
  SingularRule singular = SingularRule::kSwitch;
  OracleKind oracle = OracleKind::kPower;
};

// What is not given is as the study had it for the basis. Throws UsageError
// where a name is unknown or does not go with the basis.
HierarchicalOptions HierarchicalOptionsOf(const MethodOptions& method,
                                          const std::string& basis);

}  // namespace enfilade
