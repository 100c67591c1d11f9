// How much the radiosity varies within each panel, by the corners that the
// panel shares with its neighbours. Progressive radiosity with substructuring
// splits panels by this measure (Cohen, Chen, Wallace and Greenberg 1988).

#pragma once

#include "base/photometry.h"
#include "solver/reference/reference_scene.h"

#include <span>
#include <vector>

namespace enfilade {

// Per panel the standard deviation of the radiosities of its corners, W/m2,
// mean over the channels (eq. 8 of the 1997 study). A corner's radiosity is the
// mean of the panels of its patch that meet there.
std::vector<double> CornerDeviations(const ReferenceScene& scene,
                                     std::span<const Panel* const> panels,
                                     std::span<const Rgb> radiosities);

}  // namespace enfilade
