// The options of the hierarchical method of the study of 1997: how visibility
// is found, how a singular kernel is treated, and which oracle decides that a
// link is good enough.
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
  kTriage,      // likewise; links below inherit a share of 0 or 1
  kQuadrature,  // one ray for each pair of nodes
  kStratified,  // one ray for each pair of parts, random: the solver's own
};

enum class SingularRule : uint8_t {
  kNone,      // nothing: plain quadrature
  kSwitch,    // from centers to polygons where a source looks large
  kFlatlets,  // touching ends: transfers between flatlets (C-C)
  kNear,      // close ends: exact rows or columns; the solver's own
};

enum class OracleKind : uint8_t {
  kFormFactor,  // the larger form factor of both ends
  kPower,       // the power that goes over the link
  kPolynomial,  // how far the kernel is from a polynomial, times that power
  kTransfer,    // light beyond the basis of the ends: the solver's own
};

struct HierarchicalOptions {
  double epsilon = 0;
  VisibilityMode visibility = VisibilityMode::kTriage;
  SingularRule singular = SingularRule::kSwitch;
  OracleKind oracle = OracleKind::kPower;
};

// Options that are not given are as in the study for this basis. Throws
// UsageError if a name is unknown or does not fit the basis, or if epsilon is
// not above 0.
HierarchicalOptions HierarchicalOptionsOf(const MethodOptions& method,
                                          const std::string& basis);

}  // namespace enfilade
