// The gather: computes the irradiance that the links of a block bring to their
// receivers, H_g += sum over q of K_gq V_gq B_q, and rebuilds kernels on the
// fly.

#pragma once

#include "solver/elements/element_tree.h"
#include "solver/elements/geometry.h"
#include "solver/links/link_block.h"
#include "solver/transfer/source_group.h"

#include <span>
#include <vector>

namespace enfilade {

// One end of a block of links: a cell's patches and trees.
struct GatherSide {
  std::span<const PatchGeometry> patches;
  const CellTree* tree = nullptr;
  const SourceGroups* groups = nullptr;  // only of a source
};

// Adds to `gathered`, the receiver's irradiance (ReceivedLight), the irradiance
// from `radiosity`, an array like CellTree::Sent() of the source (totals or
// changes). Runs in parallel over receivers; the result is bit-identical for
// every number of threads.
void Gather(const LinkBlock& block,
            const GatherSide& receiver,
            const GatherSide& source,
            const CoefficientArray& radiosity,
            CoefficientArray& gathered);

}  // namespace enfilade
