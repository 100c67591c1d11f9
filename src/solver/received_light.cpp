#include "solver/received_light.h"

#include "solver/coefficient_pages.h"

namespace enfilade {
namespace {

// What is gathered is in blocks of its own: it is the solution, and whoever
// only reads that need not read the rest.
BlockKey GatheredKey(CellId cell) {
  return {BlockKind::kReceived, cell.value, 0, 0};
}

BlockKey GainKey(CellId cell) {
  return {BlockKind::kReceived, cell.value, 1, 0};
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
  LoadPages(store, GatheredKey(cell), elements, &gathered);
  return gathered;
}

void ReceivedLight::SaveGathered(BlockStorage& store,
                                 CellId cell,
                                 const CoefficientArray& gathered) {
  SavePages(store, GatheredKey(cell), gathered);
}

uint64_t ReceivedLight::BytesFor(size_t elements, const TreeShape& shape) {
  return elements * (shape.Stride() + shape.NodeStride()) * sizeof(float);
}

void ReceivedLight::Save(BlockStorage& store, CellId cell) const {
  SaveGathered(store, cell, gathered);
  SavePages(store, GainKey(cell), gain);
}

}  // namespace enfilade
