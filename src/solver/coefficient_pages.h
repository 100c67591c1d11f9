// Arrays of coefficients in the store, page by page.

#pragma once

#include "base/block_storage.h"
#include "solver/coefficient_array.h"

#include <cstddef>
#include <initializer_list>

namespace enfilade {

// Writes arrays of one cell, of the same number of elements, to the blocks that
// follow `first` by `c`: a page of each to a block. One without elements counts
// as zeros, of the stride it has.
void SavePages(BlockStorage& store,
               BlockKey first,
               std::initializer_list<const CoefficientArray*> arrays);

// Fills arrays of the same number of elements with what was saved, which may be
// of fewer: the rest stays as it is; one without elements is passed over.
// Returns of how many. DamagedStoreError if they do not match what was saved.
size_t LoadPages(const BlockStorage& store,
                 BlockKey first,
                 std::initializer_list<CoefficientArray*> arrays);

}  // namespace enfilade
