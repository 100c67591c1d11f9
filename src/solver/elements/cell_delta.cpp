#include "solver/elements/cell_delta.h"

#include "solver/elements/coefficient_pages.h"

namespace enfilade {
namespace {

BlockKey DeltaKey(CellId cell) {
  return {BlockKind::kCellDelta, cell.value};
}

}  // namespace

CoefficientArray LoadDelta(const BlockStorage& store,
                           CellId cell,
                           const TreeShape& shape,
                           size_t elements) {
  CoefficientArray delta(shape.Stride());
  LoadPages(store, DeltaKey(cell), elements, &delta);
  return delta;
}

void GrowDelta(const CellTree& tree, CoefficientArray* delta) {
  const TreeShape& shape = tree.Shape();
  const size_t known = delta->Size();
  delta->GrowTo(tree.Size());
  for (size_t i = 0; i < tree.Size(); ++i) {
    const ElementId parent(i);  // precedes its children
    const Element& e = tree.At(parent);
    if (e.first_child == 0 || e.first_child < known) {
      continue;
    }
    const ShapeBasis& basis = shape.basis->On(tree.ShapeOf(e.patch));
    for (size_t c = 0; c < kChildren; ++c) {
      const ElementId child(e.first_child + c);
      PushTo(basis, shape, c, (*delta)[parent], (*delta)[child]);
    }
  }
}

uint64_t SaveDelta(BlockStorage& store,
                   CellId cell,
                   const CoefficientArray& delta) {
  if (delta.MaxAbs() == 0) {
    EraseDelta(store, cell);
    return 0;
  }
  return SavePages(store, DeltaKey(cell), delta);
}

void EraseDelta(BlockStorage& store, CellId cell) {
  store.EraseAll(BlockKind::kCellDelta, cell.value);
}

}  // namespace enfilade
