// The radiosity that the elements of one cell gained in the cell's last turn.
//
//   paper  here      per element, channel and node
//   dB     delta     the gain of `sent` (element_tree.h) in that turn,
//                    which links of other cells may not have gathered yet, W/m2
//
// A stored delta covers the elements that existed in that turn. GrowDelta adds
// the elements made since, while the cell was refined as a source, when the
// delta is needed: so no delta has to be in memory while elements are made.

#pragma once

#include "base/block_storage.h"
#include "base/ids.h"
#include "solver/elements/coefficient_array.h"
#include "solver/elements/element_tree.h"

namespace enfilade {

// A delta of no elements if none is stored. Throws DamagedStoreError if the
// stored delta has more elements than the cell's tree.
CoefficientArray LoadDelta(const BlockStorage& store,
                           CellId cell,
                           const TreeShape& shape,
                           size_t elements);

// Grows the delta to the elements of the tree: each new element gets the
// restriction of its parent's delta. `tree` may be without coefficients.
void GrowDelta(const CellTree& tree, CoefficientArray* delta);

// Stores a delta; erases the stored one if `delta` is empty or zero. Returns
// the bytes that the delta takes in the store.
uint64_t SaveDelta(BlockStorage& store,
                   CellId cell,
                   const CoefficientArray& delta);

void EraseDelta(BlockStorage& store, CellId cell);

}  // namespace enfilade
