// Where a surface is covered: below a lamp hung close to the ceiling, where a
// chair leg stands, behind a shelf. All light is cut off there, whatever its
// source; so the edge of the cover is an error that every link to the element
// shares. No single link can see that it matters, hence it is looked for
// before links are made: elements that are partly covered are split first.

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
  double tau = 1;  // W/m: largest weighted error that may stay at an edge
  uint64_t seed = 0;
  float least_diameter = 0.001F;  // m
  // Where a cell would have more, larger edges are left. At least as many as
  // it has patches.
  size_t most_receivers = SIZE_MAX;
};

// The elements of a cell at which refinement begins: its reflecting patches,
// those that are partly covered split until the edges of the covers are found.
struct Covers {
  std::vector<ClusterItem> receivers;
  uint64_t rays = 0;
};

// A cell as the search for covers sees it.
struct CoverSide {
  CellId id;
  std::span<const PatchGeometry> patches;
  const ClusterTree* clusters = nullptr;  // of all patches
  const CellBlockers* occluders = nullptr;
  const ReflectedLight* light = nullptr;
};

Covers FindCovers(const CoverOptions& options, const CoverSide& cell);

}  // namespace enfilade
