// Surfaces of one plane, told apart by what touches what: a floor of many
// polygons is one piece, the seats of a hundred chairs are a hundred.

#pragma once

#include "partition/polygon.h"

#include <span>

namespace enfilade {

// The area in m2 of all polygons that belong to pieces of at least `least_m2`.
// The polygons lie in a plane of that normal (or of its opposite); two belong
// to one piece if no line along an edge leaves more than `gap_m` between them,
// or if a chain of others joins them.
double AreaOfLargePieces(std::span<const Polygon> polygons,
                         const Vec3& normal,
                         double gap_m,
                         double least_m2);

}  // namespace enfilade
