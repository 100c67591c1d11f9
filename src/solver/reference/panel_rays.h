// Rays from a panel with known shares of the panel's hemisphere. Their hits
// give the panel's form factors to all other panels at once, occlusion
// included.
//
//   paper      here
//   delta F    PanelRay::share: of the cosine-weighted hemisphere
//
// Hemicube: M. Cohen, D. Greenberg, The Hemi-Cube: A Radiosity Solution for
// Complex Environments, SIGGRAPH 1985. Cosine-distributed rays: T. Malley, A
// Shading Method for Computer Generated Images, 1988.

#pragma once

#include "base/random.h"
#include "solver/transfer/form_factor.h"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace enfilade {

struct PanelRay {
  Vec3f from;       // on the panel, m
  Vec3f direction;  // above it; any length
  float share = 0;  // the shares of a panel's rays sum to 1
};

// Pixels along the edge of a hemicube, which has 3 N^2 in all.
inline constexpr size_t kHemicubePixels = 64;
// Rays from a panel by montecarlo.
inline constexpr size_t kCosineRays = 4096;

// Rays through the centers of the pixels of a hemicube about the center of the
// panel: the top and the upper halves of four sides, aligned with the panel's
// first edge. The shares sum to 1 up to the error of the midpoint rule (1e-4).
std::vector<PanelRay> HemicubeRays(const TransferEnd& end);

// Cosine-distributed rays from random points of the panel.
std::vector<PanelRay> CosineRays(const TransferEnd& end, uint64_t key);

// Cosine-distributed rays from the center of the panel.
std::vector<PanelRay> CosineRaysFromCenter(const TransferEnd& end,
                                           uint64_t key);

}  // namespace enfilade
