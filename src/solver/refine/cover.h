// Finds where a surface is covered: below a lamp hung close to the ceiling,
// under a chair leg, behind a shelf. A cover cuts off all light, whatever its
// source, so every link to an element shares the error at the edge of the
// cover. No single link can see that this error matters. FindCovers therefore
// looks for covers before links are made and splits partly covered elements
// first.

#pragma once

#include "solver/elements/geometry.h"
#include "solver/refine/reflected_light.h"
#include "solver/transfer/cluster_tree.h"
#include "visibility/occlusion.h"

#include <cstdint>
#include <span>
#include <vector>

namespace enfilade {

struct CoverOptions {
  double tau = 1;  // W/m: largest weighted error allowed at an edge
  uint64_t seed = 0;
  float least_diameter = 0.001F;  // m
  // If a cell would have more receivers, FindCovers allows larger errors at
  // edges. Must be at least the number of patches of the cell.
  size_t most_receivers = SIZE_MAX;
};

// The elements of a cell at which refinement begins: its reflecting patches, of
// which partly covered ones are split until the edges of the covers are found.
struct Covers {
  std::vector<ClusterItem> receivers;
  uint64_t rays = 0;  // of the search whose result this is
};

// A cell as the search for covers sees it.
struct CoverSide {
  CellId id;
  std::span<const PatchGeometry> patches;
  const ClusterTree* clusters = nullptr;  // of all patches
  const RayBlockers* blockers = nullptr;
  const ReflectedLight* light = nullptr;
};

Covers FindCovers(const CoverOptions& options, const CoverSide& cell);

}  // namespace enfilade
