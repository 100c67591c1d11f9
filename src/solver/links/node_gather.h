// The gather for bases whose transfers are made at the bases' own nodes
// (node_transfer.h).

#pragma once

#include "solver/links/gather.h"

namespace enfilade {

// Links [first, last) of a block.
struct LinkRange {
  size_t first = 0;
  size_t last = 0;
};

// Adds the irradiance that the links of the range bring, as Gather does.
// Requires a basis that has nodes of its own.
void GatherAtNodes(const LinkBlock& block,
                   LinkRange range,
                   const GatherSide& receiver,
                   const GatherSide& source,
                   const CoefficientArray& radiosity,
                   CoefficientArray& gathered);

}  // namespace enfilade
