// How large the surfaces are that the patches of a cell are parts of, to tell
// which of two in one place is seen.

#pragma once

#include "partition/patch.h"
#include "scene/box_tree.h"

#include <cstdint>
#include <span>
#include <vector>

namespace enfilade {

// What is known of a face of the scene.
struct FaceFacts {
  float surface_m2 = 0;  // of the surface that it is, or is a piece of
  // Tells apart the closed solids that faces bound; 0: none.
  uint32_t solid = 0;
};

// The ranks of a patch's surface among those of the cell, the smallest first.
// Areas that differ by rounding have one rank.
struct SurfaceRank {
  uint32_t here = 0;      // by the area within the cell
  uint32_t anywhere = 0;  // by that, or by its largest whole face if larger
};

// The ranks of the surface that each patch is part of. A surface consists of
// the cell's patches of one material that lie in one plane, face the same way
// and touch, whatever objects they are of: a floor of slabs is one surface.
// Where its patches lie in one another their area counts once. `tree`: TreeOf.
// `faces`: by FaceId.
std::vector<SurfaceRank> RankSurfaces(std::span<const Patch> patches,
                                      const BoxTree& tree,
                                      std::span<const FaceFacts> faces);

}  // namespace enfilade
