// Solids that polygons close off: boards, legs, slabs. No light gets into one,
// unless a lamp stands in it, so that the inner sides of its faces stay dark
// whatever is computed: docs/decisions/closed-solids.md.

#pragma once

#include "base/vec.h"
#include "scene/face.h"
#include "scene/region_join.h"

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace enfilade {

// For each polygon (loops of indices into `vertices`, welded) the solid whose
// surface it is part of; nullopt where none is closed, or not surely.
//
// A surface counts as closed if of polygons that share edges two meet at every
// edge, if they can be turned to agree, and if then its winding number (van
// Oosterom and Strackee 1983, eq. 8) is 1 or -1 by `beside`, m, on one side of
// the middle of every polygon and 0 on the other.
std::vector<std::optional<ClosedSolid>> FindClosedSolids(
    std::span<const Point3> vertices,
    std::span<const VertexLoop> polygons,
    double beside);

}  // namespace enfilade
