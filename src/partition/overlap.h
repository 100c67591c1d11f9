// Surfaces that lie in one another: the back of a cupboard in the plane of its
// wall, a picture on the wall, a lamp in the face of a ceiling, a face that an
// exporter wrote twice.
//
// Where two patches lie in one plane, face the same way and overlap, only one
// of them can be seen. If both were seen, each would send all its light, and
// the patches that face them would get twice the light there is; in a closed
// gap light would grow with every bounce. docs/decisions/overlaps.md has the
// rule's reasons.

#pragma once

#include "base/memory.h"
#include "partition/overlap_sizes.h"
#include "partition/patch.h"

#include <cstdint>
#include <span>
#include <vector>

namespace enfilade {

// Surfaces nearer to each other than this lie in one plane, m. Rays cannot tell
// such surfaces apart, because every ray is cut by half of this length at
// either end.
inline constexpr double kCoincidentM = 2e-4;

// The least cosine between the normals of two patches that face the same way:
// two degrees. At larger angles the distances of the corners decide anyway.
inline constexpr double kLeastFacing = 0.9994;

struct OverlapCounts {
  uint64_t dropped = 0;  // patches of which a part was there twice
  double area_m2 = 0;    // of those parts, and of the strips cut off
  uint64_t moved = 0;    // patches put in front of another
};

// Changes the patches of one cell so that no two patches that face the same way
// lie in one another:
//
// - A surface that is there twice (with the same material and side, or with the
//   same outline in the cell) is kept once: the smaller one keeps only what the
//   larger one leaves free, unless the smaller one lies so far in front of the
//   larger one that rays end at it. Of two sides with one outline, one that
//   reflects is kept before a black one, and a front before a back; of two
//   fronts, or two backs, the one that is smaller elsewhere is seen.
// - An inside that lies in one plane with an outside of its own solid, of a
//   sheet thinner than kCoincidentM, goes.
// - Otherwise the smaller surface (overlap_sizes.h), as a whole, is seen. One
//   that emits counts as smaller than one that does not, and the inside of a
//   solid as smaller than all others. It is put kApartM in front of the other,
//   on the side it faces. What stands on it begins there (overlap_rims.h).
//
// Patches that are not touched keep their order; the pieces of a patch take its
// place. The memory of the pieces is charged to the budget. `faces`: by FaceId.
OverlapCounts SeparateOverlaps(std::vector<Patch>& patches,
                               std::span<const FaceFacts> faces,
                               MemoryBudget& budget);

// The memory that SeparateOverlaps takes for so many patches while it works,
// without the pieces.
uint64_t SeparateOverlapsBytes(size_t patches);

}  // namespace enfilade
