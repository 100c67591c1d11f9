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

// The solids of some polygons.
struct PolygonSolids {
  // For each polygon the solid whose surface it is part of; nullopt where none
  // is closed, or not surely.
  std::vector<std::optional<ClosedSolid>> solids;
  // The same number for polygons of the same solid, from 1; 0 for all others.
  std::vector<uint32_t> numbers;
};

// Of polygons that are loops of indices into `vertices`, welded.
//
// A surface counts as closed if of polygons that share edges two meet at every
// edge, if they can be turned to agree, and if then its winding number (van
// Oosterom and Strackee 1983, eq. 8) is 1 or -1 by `beside`, m, on one side of
// the middle of every polygon and 0 on the other.
PolygonSolids FindClosedSolids(std::span<const Point3> vertices,
                               std::span<const VertexLoop> polygons,
                               double beside);

}  // namespace enfilade
