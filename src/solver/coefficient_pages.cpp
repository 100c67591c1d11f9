#include "solver/coefficient_pages.h"

#include "base/bytes.h"
#include "base/error.h"
#include "base/parallel.h"

#include <algorithm>
#include <vector>

namespace enfilade {
namespace {

constexpr size_t kPageElements = CoefficientArray::kPageElements;

size_t PagesOf(size_t elements) {
  return (elements + kPageElements - 1) / kPageElements;
}

// Fills a page of each array; returns how many elements the arrays have.
size_t TakePage(const Bytes& bytes,
                size_t page,
                std::initializer_list<CoefficientArray*> arrays) {
  ByteReader in(bytes);
  const size_t saved = in.GetVarint();
  const auto has_more = [&](const CoefficientArray* array) {
    return array->Size() > 0 && saved > array->Size();
  };
  if (std::any_of(arrays.begin(), arrays.end(), has_more)) {
    throw DamagedStoreError("a cell has more coefficients than elements");
  }
  const size_t count =
      std::min(kPageElements, saved - std::min(saved, page * kPageElements));
  for (CoefficientArray* array : arrays) {
    if (array->Size() == 0) {
      in.GetArray<uint8_t>();
    } else {
      GetShuffled(&in, array->Page(page).first(count * array->Stride()));
    }
  }
  return saved;
}

}  // namespace

void SavePages(BlockStorage& store,
               BlockKey first,
               std::initializer_list<const CoefficientArray*> arrays) {
  size_t elements = 0;
  size_t stride = 0;
  for (const CoefficientArray* array : arrays) {
    elements = std::max(elements, array->Size());
    stride += array->Stride();
  }
  ParallelFor(PagesOf(elements), [&](size_t page) {
    const size_t count =
        std::min(kPageElements, elements - page * kPageElements);
    ByteWriter out;
    out.Reserve(count * stride * sizeof(float) + 16);
    out.PutVarint(elements);
    for (const CoefficientArray* array : arrays) {
      if (array->Size() == 0) {
        PutShuffled(std::vector<float>(count * array->Stride()), &out);
      } else {
        PutShuffled(array->Page(page), &out);
      }
    }
    BlockKey key = first;
    key.c += static_cast<uint32_t>(page);
    store.Put(key, out.View());
  });
}

size_t LoadPages(const BlockStorage& store,
                 BlockKey first,
                 std::initializer_list<CoefficientArray*> arrays) {
  const auto bytes = store.Get(first);
  if (!bytes) {
    return 0;
  }
  const size_t saved = TakePage(*bytes, 0, arrays);
  const size_t pages = PagesOf(saved);
  ParallelFor(pages - std::min<size_t>(pages, 1), [&](size_t i) {
    BlockKey key = first;
    key.c += static_cast<uint32_t>(i + 1);
    if (TakePage(store.GetOrThrow(key), i + 1, arrays) != saved) {
      throw DamagedStoreError("the coefficients of a cell are of two states");
    }
  });
  return saved;
}

}  // namespace enfilade
