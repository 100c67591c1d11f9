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
  const auto bytes = store.Get(first);
  if (!bytes) {
    return 0;
  }
  ByteReader in(*bytes);
  const size_t saved = in.GetVarint();
  if (saved == 0 || saved > most_elements) {
    throw DamagedStoreError("a cell has more coefficients than elements");
  }
  array->GrowTo(saved);
  FillPage(&in, saved, 0, array);
  const size_t pages = PagesOf(saved);
  ParallelFor(pages - 1, [&](size_t i) {
    BlockKey key = first;
    key.c += static_cast<uint32_t>(i + 1);
    const Bytes page = store.GetOrThrow(key);
    ByteReader rest(page);
    if (rest.GetVarint() != saved) {
      throw DamagedStoreError("the coefficients of a cell are of two states");
    }
    FillPage(&rest, saved, i + 1, array);
  });
  return saved;
}

}  // namespace enfilade
