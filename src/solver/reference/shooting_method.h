// Progressive radiosity by shooting (Cohen, Chen, Wallace and Greenberg 1988),
// optionally with substructuring: elements below patches, refined where the
// radiosity is steep (Cohen, Greenberg, Immel and Brock 1986).
//
//   paper            here
//   patch            source: shoots, a panel of the coarse dicing
//   element          receiver: a panel below a source; without substructuring
//                    receivers and sources are the same panels
//   delta B          unshot, W/m2 per channel
//
// At every moment the irradiance of every receiver e is exactly
//   H_e = sum over sources p of F_ep shot_p,
// and unshot_p is the mean radiosity of p's receivers less shot_p. Receivers
// can therefore be split at any time, and the children gather what has been
// shot so far. (Willmott and Heckbert 1997, figure 5, split while shooting and
// let children inherit, which caused their over-refinement.)
//
// Unlike in the papers, form factors are kept: a source that shoots again needs
// no rays. Memory: 4 bytes per pair of source and receiver.

#pragma once

#include "base/memory.h"
#include "solver/reference/form_factors.h"
#include "solver/reference/panel_solution.h"
#include "solver/reference/reference_scene.h"

#include <optional>

namespace enfilade {

struct ShootingOptions {
  double source_edge = 1;  // m, the longest of a source
  // Substructuring: receivers start at half of `source_edge`, and are split
  // while the deviation of the radiosities at their corners (eq. 8) is above
  // this share of the mean reflected radiosity. If not set, the sources are the
  // receivers.
  std::optional<double> gradient;
  // The most receivers, split ones included. If they do not suffice, the
  // steepest are split first.
  size_t most_receivers = kMostPanelReceivers;
  // Shooting ends when the estimate of all light still to come (unshot power
  // times R, eq. 7) is below this share of the reflected power.
  double still_to_come = 1e-3;
  bool ambient = false;  // add the light still to come, evenly
};

PanelSolution SolveByShooting(const ReferenceScene& scene,
                              FormFactors& form_factors,
                              const ShootingOptions& options,
                              const RunControl& control,
                              MemoryBudget& budget);

}  // namespace enfilade
