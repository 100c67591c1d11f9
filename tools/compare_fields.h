// The comparison behind Compare, on any two views of one building.

#pragma once

#include <functional>
#include <span>
#include <vector>

#include "tools/building_view.h"
#include "tools/compare.h"

namespace enfilade {

using RadiosityField =
    std::function<std::vector<Rgb>(std::span<const PatchPoint>)>;

// The deviation of `a` from the reference `b` over the building's reflecting
// sides. Throws InputError if b reflects no light.
CompareSummary CompareFields(const BuildingView& building,
                             const RadiosityField& a,
                             const RadiosityField& b,
                             const CompareOptions& options,
                             MemoryBudget& budget);

}  // namespace enfilade
