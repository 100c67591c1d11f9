// Closes the cracks between the polygons of a model whose rooms are meant to
// be closed: a file's rounding leaves walls that end a millimetre short of the
// floor, and one wall in two planes a millimetre apart.

#pragma once

#include "base/memory.h"
#include "base/vec.h"

#include <cstdint>
#include <vector>

namespace enfilade {

// A polygon with the openings in it, which stay in its plane.
struct PolygonWithOpenings {
  std::vector<Point3> outline;
  std::vector<std::vector<Point3>> openings;
};

struct CrackSummary {
  uint64_t moved = 0;  // vertices moved by more than a micrometre
  uint64_t added = 0;  // vertices added where others touch an edge
  double greatest_move_m = 0;
};

// Makes touching exact: polygons in one plane up to the tolerance get one
// (plane_snap.h), and every vertex that comes within the tolerance of polygons
// is moved to where their planes meet; a vertex on an edge of another polygon,
// in one plane with it, becomes a vertex of that polygon too. No vertex moves
// by more than four times the tolerance; one that would have to stays off some
// of the planes. Polygons may lose vertices that fall together, even all of
// them. Polygons without area are left alone.
CrackSummary CloseCracks(double tolerance,
                         MemoryBudget& budget,
                         std::vector<PolygonWithOpenings>& polygons);

}  // namespace enfilade
