// The bins of a density of points (density.h): equal parts of the line of the
// reflecting sides, plus a bin for each stretch that is far brighter than most
// in the solution. A bulb lights a spot of a square centimetre a thousand times
// as brightly as its house. An error there may be most of the total error, and
// equal parts of a few square decimetres cannot resolve it.

#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "tools/building_view.h"
#include "tools/verify/points.h"

namespace enfilade {

// A stretch of the line. Its level is the squared reflected radiosity of the
// solution, averaged over the channels.
struct LightBin {
  double begin = 0;  // m2
  double end = 0;
  double level = 0;
};

// The most bytes that finding and holding the bins takes, for this many equal
// parts.
uint64_t LightBinBytes(uint32_t equal_parts);

// Returns bins that cover the line, in ascending order. Reads every cell of the
// solution twice.
std::vector<LightBin> FindLightBins(const BuildingView& view,
                                    const SidePoints& sides,
                                    uint32_t equal_parts,
                                    uint32_t points_at_once);

// Lays `others` over `bins` and returns the result. Both are ascending, and the
// others do not overlap one another.
std::vector<LightBin> Overlaid(std::span<const LightBin> bins,
                               std::span<const LightBin> others);

}  // namespace enfilade
