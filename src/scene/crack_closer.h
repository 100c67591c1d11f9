// Closes the cracks between the polygons of a model whose rooms are meant to
// be closed. The rounding of a file leaves walls that end a millimetre short of
// the floor, and puts one wall into two planes a millimetre apart.

#pragma once

#include "base/memory.h"
#include "base/vec.h"

#include <cstdint>
#include <vector>

namespace enfilade {

// A polygon and its openings, which stay in the polygon's plane.
struct PolygonWithOpenings {
  std::vector<Point3> outline;
  std::vector<std::vector<Point3>> openings;
};

struct CrackSummary {
  uint64_t moved = 0;  // vertices moved by more than a micrometre
  uint64_t added = 0;  // vertices added where others touch an edge
  double greatest_move_m = 0;
};

// Makes polygons that nearly touch touch exactly. Polygons that lie in one
// plane up to the tolerance get a common plane (plane_snap.h). Every vertex
// within the tolerance of polygons moves to where their planes meet. A vertex
// on an edge of another polygon in the same plane becomes a vertex of that
// polygon too. Beyond the tolerance, within which vertices are welded, none
// moves by more than four times the tolerance; one that would have to move
// farther stays off some of the planes. Vertices of a polygon that fall
// together are dropped, even all of them. Polygons without area are left alone.
CrackSummary CloseCracks(double tolerance,
                         MemoryBudget& budget,
                         std::vector<PolygonWithOpenings>& polygons);

}  // namespace enfilade
