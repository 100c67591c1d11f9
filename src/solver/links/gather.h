// The gather: irradiance that the links of a block bring to their receivers,
// H_g += sum over q of K_gq V_gq B_q, kernels rebuilt on the way.

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
  const SourceGroups* groups = nullptr;  // of the source
};

// Adds to `gathered` (that of the receiver: ReceivedLight) what
// `radiosity` (like CellTree::Sent() of the source; totals or changes) sends.
// Parallel over receivers; the same bits for every number of threads.
void Gather(const LinkBlock& block,
            const GatherSide& receiver,
            const GatherSide& source,
            const CoefficientArray& radiosity,
            CoefficientArray& gathered);

}  // namespace enfilade
