#include "solver/coefficient_pages.h"

#include "base/bytes.h"
#include "base/error.h"

#include <algorithm>
#include <vector>

namespace enfilade {
namespace {

constexpr size_t kPageElements = CoefficientArray::kPageElements;

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
  for (size_t page = 0; page * kPageElements < elements; ++page) {
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
  }
}

size_t LoadPages(const BlockStorage& store,
                 BlockKey first,
                 std::initializer_list<CoefficientArray*> arrays) {
  const size_t room = (*arrays.begin())->Size();
  size_t saved = 0;
  for (size_t page = 0; page == 0 || page * kPageElements < saved; ++page) {
    BlockKey key = first;
    key.c += static_cast<uint32_t>(page);
    const auto bytes = page == 0 ? store.Get(key) : store.GetOrThrow(key);
    if (!bytes) {
      return 0;
    }
    ByteReader in(*bytes);
    saved = in.GetVarint();
    if (saved > room) {
      throw DamagedStoreError("a cell has more coefficients than elements");
    }
    const size_t count =
        std::min(kPageElements, saved - std::min(saved, page * kPageElements));
    for (CoefficientArray* array : arrays) {
      GetShuffled(&in, array->Page(page).first(count * array->Stride()));
    }
  }
  return saved;
}

}  // namespace enfilade
