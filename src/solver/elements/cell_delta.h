// What the elements of one cell have last sent more than before.
//
//   paper  here      per element, channel and node
//   dB     delta     what `sent` (element_tree.h) gained in the cell's last
//                    turn, of which links of other cells may still have to be
//                    told, W/m2
//
// It is of the elements that there were in that turn; those made since, where
// the cell was refined as a source, are added when it is asked for: so no delta
// has to be in memory while elements are made.

#pragma once

#include "base/block_storage.h"
#include "base/ids.h"
#include "solver/elements/coefficient_array.h"
#include "solver/elements/element_tree.h"

namespace enfilade {

// Of no element where there is none. DamagedStoreError if it is of more than
// the tree of the cell has by now.
CoefficientArray LoadDelta(const BlockStorage& store,
                           CellId cell,
                           const TreeShape& shape,
                           size_t elements);

// Adds the elements that the tree has beyond the delta's: each has the
// restriction of its parent's. `tree` may be without coefficients.
void GrowDelta(const CellTree& tree, CoefficientArray* delta);

// One of no element, or of zeros, leaves none. Returns what it takes in the
// store.
uint64_t SaveDelta(BlockStorage& store,
                   CellId cell,
                   const CoefficientArray& delta);

void EraseDelta(BlockStorage& store, CellId cell);

}  // namespace enfilade
