// What one run of refinement is asked for.

#pragma once

#include <cstdint>

namespace enfilade {

struct RefineOptions {
  double tau = 1;                // W/m: largest weighted error of a link
  double tau_weak = 1;           // W/m: smaller transfers are sampled
  uint64_t seed = 0;             // of the visibility samples
  float least_diameter = 2e-5F;  // m; smaller elements are not split
  bool counts_black = false;     // count errors on black surfaces
};

}  // namespace enfilade
