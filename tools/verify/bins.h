// The bins of a density of points (density.h): equal parts of the line
// of the reflecting sides, and besides a bin for each stretch of it that the
// solution says is far brighter than most. A bulb lights a spot of a square
// centimetre a thousand times as brightly as its house; what is wrong there may
// be most of the error, and equal parts of a few square decimetres do not know
// of it.

#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "tools/building_view.h"
#include "tools/verify/points.h"

namespace enfilade {

// A stretch of the line, and how bright it is: the squared reflected radiosity
// of the solution, mean of the channels.
struct LightBin {
  double begin = 0;  // m2
  double end = 0;
  double level = 0;
};

// What makes and holds the bins takes at most this, for so many equal parts.
uint64_t LightBinBytes(uint32_t equal_parts);

// They cover the line, in ascending order. Reads every cell of the solution
// twice.
std::vector<LightBin> FindLightBins(const BuildingView& view,
                                    const SidePoints& sides,
                                    uint32_t equal_parts,
                                    uint32_t points_at_once);

// Ascending bins with others, ascending and apart, laid over them.
std::vector<LightBin> Overlaid(std::span<const LightBin> bins,
                               std::span<const LightBin> others);

}  // namespace enfilade
