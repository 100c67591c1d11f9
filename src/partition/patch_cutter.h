// Cuts convex polygons into the fewest parallelograms and triangles.

#pragma once

#include "base/vec.h"
#include "partition/patch.h"
#include "partition/polygon.h"

#include <vector>

namespace enfilade {

// Origin, edges and shape of a patch.
struct PatchPiece {
  Point3 origin;
  Vec3 u, v;
  PatchShape shape{};
};

// Neighbours whose corners have moved by this, m, overlap by no more than what
// counts as rounding (kNarrowM in overlap_pairs.h).
inline constexpr double kMostCornerMoveM = 5e-5;

// The pieces cover the polygon without overlap, face the same way as the
// polygon and have its vertices as corners. The cut has the fewest pieces
// possible and, among such cuts, the best shaped ones; a polygon of more than
// 20 vertices is cut into triangles only. A quadrilateral counts as a
// parallelogram up to 1e-6 of its size. One that is a parallelogram but for
// rounding becomes the nearest one, whose corners are up to kMostCornerMoveM
// beside those of the polygon. Empty for a polygon without area.
std::vector<PatchPiece> CutIntoPatches(const Polygon& polygon);

// Cuts long parallelograms across into parts of at least a metre in length that
// are as near to squares as possible. Elements have the proportions of their
// patch: the elements of a corridor's whole ceiling would be split across in
// vain wherever light varies along the corridor.
std::vector<PatchPiece> CutLongOnes(const std::vector<PatchPiece>& pieces);

// The number of patches that CutIntoPatches and CutLongOnes make of a polygon;
// of one of more than 20 corners, at most so many.
size_t CountPatches(const Polygon& polygon);

// The corners of a patch, counter-clockwise seen from its front.
Polygon PolygonOf(const Patch& patch);

// Appends the pieces of a part of a patch, moved by `offset`. In all else the
// pieces are copies of the patch.
void AppendAsPatches(Patch patch,
                     const Polygon& part,
                     Vec3 offset,
                     std::vector<Patch>* patches);

}  // namespace enfilade
