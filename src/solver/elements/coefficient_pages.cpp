#include "solver/elements/coefficient_pages.h"

#include "base/bytes.h"
#include "base/error.h"
#include "base/parallel.h"

#include <algorithm>
#include <atomic>

namespace enfilade {
namespace {

constexpr size_t kPageElements = CoefficientArray::kPageElements;

size_t PagesOf(size_t elements) {
  return (elements + kPageElements - 1) / kPageElements;
}

// Fills a page of the array from a block whose element count is already read.
void FillPage(ByteReader* in,
              size_t saved,
              size_t page,
              CoefficientArray* array) {
  const size_t count =
      std::min(kPageElements, saved - std::min(saved, page * kPageElements));
  GetShuffled(in, array->Page(page).first(count * array->Stride()));
}

}  // namespace

uint64_t SavePages(BlockStorage& store,
                   BlockKey first,
                   const CoefficientArray& array) {
  std::atomic<uint64_t> stored = 0;
  ParallelFor(array.PageCount(), [&](size_t page) {
    ByteWriter out;
    out.Reserve(array.Page(page).size_bytes() + 16);
    out.PutVarint(array.Size());
    PutShuffled(array.Page(page), &out);
    BlockKey key = first;
    key.c += static_cast<uint32_t>(page);
    stored += store.Put(key, out.View());
  });
  return stored;
}

size_t LoadPages(const BlockStorage& store,
                 BlockKey first,
                 size_t most_elements,
                 CoefficientArray* array) {
  const auto saved = ReadBlockIfAny(store, first, [&](ByteReader& in) {
    const size_t elements = in.GetVarint();
    if (elements == 0 || elements > most_elements) {
      throw DamagedStoreError("it is of more elements than the cell has");
    }
    array->GrowTo(elements);
    FillPage(&in, elements, 0, array);
    return elements;
  });
  if (!saved) {
    return 0;
  }
  ParallelFor(PagesOf(*saved) - 1, [&](size_t i) {
    BlockKey key = first;
    key.c += static_cast<uint32_t>(i + 1);
    ReadBlock(store, key, [&](ByteReader& in) {
      const size_t elements = in.GetVarint();
      if (elements != *saved) {
        throw DamagedStoreError("it is of another state than the first page");
      }
      FillPage(&in, elements, i + 1, array);
      return elements;
    });
  });
  return *saved;
}

}  // namespace enfilade
