// The rims of surfaces that were put in front of others (overlap.h).
//
// The closed end of a lamp's housing lies in the plane of the ceiling and is
// put kApartM in front of it. The walls of the housing still begin at the
// ceiling: the strip of them that lies behind the end is dark, in a place that
// may be thousands of times as bright as the room. No such strip is in the
// scene, and refining it would cost most of the links. So what stands on a
// raised piece and faces it begins at the piece.

#pragma once

#include "base/memory.h"
#include "partition/overlap_pieces.h"
#include "partition/patch.h"
#include "scene/box_tree.h"

#include <cstdint>
#include <span>
#include <vector>

namespace enfilade {

// A strip along an edge of a patch, of which the edge is from corner `edge` to
// the next one. `share`: of the patch's extent across that edge.
struct RimCut {
  uint32_t patch = 0;
  uint32_t edge = 0;
  double share = 0;
};

// The strips of untouched patches that lie behind raised pieces, by patch. An
// edge counts if raised pieces cover all of it: otherwise cutting its strip off
// would open a crack. `tree`: TreeOf(patches). The memory is charged to
// `charge`.
std::vector<RimCut> FindRims(std::span<const Patch> patches,
                             const BoxTree& tree,
                             const OverlapPieces& pieces,
                             GrowingCharge* charge);

// The patch without the strip.
Patch WithoutRim(Patch patch, const RimCut& cut);

}  // namespace enfilade
