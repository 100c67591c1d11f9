// From the links that refinement makes to the link block and the trees of their
// cells.

#pragma once

#include "solver/elements/element_tree.h"
#include "solver/elements/geometry.h"
#include "solver/elements/received_light.h"
#include "solver/links/link_block.h"
#include "solver/refine/raw_links.h"

#include <span>

namespace enfilade {

// A cell whose tree grows with its links.
struct GrowingSide {
  std::span<const PatchGeometry> patches;
  CellTree* tree = nullptr;
};

// Appends raw links to a block, making the elements that they name, and adds
// to the receiver's gains.
void ApplyLinks(const RawLinks& raw,
                const GrowingSide& receiver,
                const GrowingSide& source,
                ReceivedLight* received,
                LinkBlock* block);

}  // namespace enfilade
