// Surfaces that lie in one another: a cupboard's back in the plane of its wall,
// a picture on it, a lamp in the face of a ceiling, a face that an exporter
// wrote twice.
//
// Of two patches that lie in one plane and face the same way, only one can be
// seen where they overlap. If both were, each would send all its light, and
// what faces them would get twice what there is: in a closed gap light would
// grow with every bounce. docs/decisions/overlaps.md has the rule's reasons.

#pragma once

#include "base/memory.h"
#include "partition/patch.h"

#include <cstdint>
#include <vector>

namespace enfilade {

// Surfaces nearer to each other than this lie in one plane, m. Rays cannot tell
// them apart: they are cut by half of it at either end.
inline constexpr double kCoincidentM = 2e-4;

// Two patches face the same way: two degrees, beyond which the distances of
// their corners decide anyway.
inline constexpr double kLeastFacing = 0.9994;

struct OverlapCounts {
  uint64_t dropped = 0;  // patches of which a part was there twice
  double area_m2 = 0;    // of those parts
  uint64_t moved = 0;    // patches put before another
};

// Leaves the patches of one cell so that no two that face the same way lie in
// one another:
//
// - what is there twice (one material and side, or one outline) is kept once,
//   the smaller face in what the larger one leaves, if it does not lie so far
//   before that one that rays end at it;
// - else the smaller face is the one that is seen, what emits before what does
//   not, and the inside of a solid before all: it is put kApartM before the
//   other, on the side it faces.
//
// Patches that are not touched keep their order, pieces stand where the patch
// was. What pieces take is charged to the budget.
OverlapCounts SeparateOverlaps(std::vector<Patch>& patches,
                               MemoryBudget& budget);

// What SeparateOverlaps takes for so many patches while it works, pieces aside.
uint64_t SeparateOverlapsBytes(size_t patches);

}  // namespace enfilade
