// Arrays of coefficients in the store, page by page.

#pragma once

#include "base/block_storage.h"
#include "solver/elements/coefficient_array.h"

#include <cstddef>

namespace enfilade {

// Writes an array of one cell to the blocks that follow `first` by `c`: a page
// to each. Returns what they take in the store.
uint64_t SavePages(BlockStorage& store,
                   BlockKey first,
                   const CoefficientArray& array);

// Fills an array with what was saved, at most so many elements, and grows it
// where it has fewer; what it has beyond them stays as it is. Returns how many
// were saved. DamagedStoreError if that contradicts itself or is more.
size_t LoadPages(const BlockStorage& store,
                 BlockKey first,
                 size_t most_elements,
                 CoefficientArray* array);

}  // namespace enfilade
