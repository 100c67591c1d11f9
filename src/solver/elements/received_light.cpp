#include "solver/elements/received_light.h"

#include "solver/elements/coefficient_pages.h"

namespace enfilade {
namespace {

// The gathered irradiance has its own blocks because it is the solution: a
// reader of the solution alone need not read the rest.
BlockKey GatheredKey(CellId cell) {
  return {BlockKind::kReceived, cell.value, 0, 0};
}

BlockKey GainKey(CellId cell) {
  return {BlockKind::kReceived, cell.value, 1, 0};
}

BlockKey KeptKey(CellId cell) {
  return {BlockKind::kReceived, cell.value, 2, 0};
}

uint64_t PagesFrom(const BlockStorage& store, const BlockKey& first) {
  return store.Count(first.kind, first.a, first.b);
}

}  // namespace

ReceivedLight ReceivedLight::Load(const BlockStorage& store,
                                  CellId cell,
                                  const TreeShape& shape,
                                  size_t elements) {
  ReceivedLight received(shape);
  received.GrowTo(elements);
  LoadPages(store, GatheredKey(cell), elements, &received.gathered);
  LoadPages(store, GainKey(cell), elements, &received.gain);
  return received;
}

CoefficientArray ReceivedLight::LoadGathered(const BlockStorage& store,
                                             CellId cell,
                                             const TreeShape& shape,
                                             size_t elements) {
  CoefficientArray gathered(shape.Stride());
  gathered.GrowTo(elements);
  if (LoadPages(store, KeptKey(cell), elements, &gathered) == 0) {
    LoadPages(store, GatheredKey(cell), elements, &gathered);
  }
  return gathered;
}

uint64_t ReceivedLight::SaveGathered(BlockStorage& store,
                                     CellId cell,
                                     const CoefficientArray& gathered) {
  return SavePages(store, GatheredKey(cell), gathered);
}

void ReceivedLight::KeepForReaders(BlockStorage& store, CellId cell) {
  BlockKey from = GatheredKey(cell);
  BlockKey to = KeptKey(cell);
  if (PagesFrom(store, to) > 0) {
    return;
  }
  for (const uint64_t pages = PagesFrom(store, from); from.c < pages;
       ++from.c, ++to.c) {
    store.Put(to, store.GetOrThrow(from));
  }
}

void ReceivedLight::ForgetKept(BlockStorage& store, CellId cell) {
  const BlockKey kept = KeptKey(cell);
  store.EraseAll(kept.kind, kept.a, kept.b);
}

uint64_t ReceivedLight::BytesFor(size_t elements, const TreeShape& shape) {
  return elements * (shape.Stride() + shape.NodeStride()) * sizeof(float);
}

uint64_t ReceivedLight::Save(BlockStorage& store, CellId cell) const {
  return SaveGathered(store, cell, gathered) +
         SavePages(store, GainKey(cell), gain);
}

}  // namespace enfilade
