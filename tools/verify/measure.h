// The measurement behind Verify, on any view of a building.

#pragma once

#include "tools/building_view.h"
#include "tools/verify/verify.h"

namespace enfilade {

// Needs the view's radiosity, not its irradiance. Throws InputError if no side
// reflects or no light reaches a reflecting side.
VerifySummary MeasureError(const BuildingView& view,
                           const VerifyOptions& options,
                           MemoryBudget& budget);

}  // namespace enfilade
