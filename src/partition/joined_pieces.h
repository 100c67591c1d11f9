// Groups the surfaces of one plane into connected pieces: a floor of many
// polygons is one piece, the seats of a hundred chairs are a hundred pieces.

#pragma once

#include "partition/polygon.h"

#include <span>

namespace enfilade {

// The area in m2 of all polygons that belong to pieces of at least `least_m2`.
// All polygons lie in one plane with that normal (or its opposite). Two
// polygons belong to one piece if no line parallel to an edge of either
// separates them with a gap of more than `gap_m`, or if a chain of other
// polygons joins them.
double AreaOfLargePieces(std::span<const Polygon> polygons,
                         const Vec3& normal,
                         double gap_m,
                         double least_m2);

}  // namespace enfilade
