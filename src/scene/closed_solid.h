// Solids that polygons close off: boards, legs, slabs. No light gets into a
// solid unless a lamp stands in it, so the inner sides of its faces stay dark:
// docs/decisions/closed-solids.md.

#pragma once

#include "base/vec.h"
#include "scene/face.h"
#include "scene/vertex_loop.h"

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace enfilade {

// The solids of some polygons.
struct PolygonSolids {
  // For each polygon the solid whose surface it is part of; nullopt if no such
  // surface is certain to be closed.
  std::vector<std::optional<ClosedSolid>> solids;
  // For each polygon the number of its solid, from 1; 0 for all others.
  std::vector<uint32_t> numbers;
};

// Finds the solids of polygons, which are loops of indices into the welded
// `vertices`.
//
// Polygons that share edges count as a closed surface under three conditions:
// exactly two of them meet at every edge; they can be turned to agree; and
// `beside` metres off the middle of every polygon the winding number is then 0
// on one side and on the other 1, or -1 for all of them, also near its corners.
PolygonSolids FindClosedSolids(std::span<const Point3> vertices,
                               std::span<const VertexLoop> polygons,
                               double beside);

}  // namespace enfilade
