// Arrays of coefficients in the store, page by page.

#pragma once

#include "base/block_storage.h"
#include "solver/elements/coefficient_array.h"

#include <cstddef>

namespace enfilade {

// Writes an array of one cell, one page per block; the keys count up from
// `first` in their part `c`. What is stored there must not have more pages.
// Returns the bytes that the blocks take in the store.
uint64_t SavePages(BlockStorage& store,
                   BlockKey first,
                   const CoefficientArray& array);

// Fills an array with what SavePages stored, and grows the array if it has
// fewer elements; further elements of the array stay as they are. Returns the
// number of stored elements, 0 if none. Throws DamagedStoreError if the blocks
// contradict each other or hold more than `most_elements`.
size_t LoadPages(const BlockStorage& store,
                 BlockKey first,
                 size_t most_elements,
                 CoefficientArray* array);

}  // namespace enfilade
