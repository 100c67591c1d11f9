// What the elements of one cell have received.
//
//   paper  here      per element, channel and node
//   H      gathered  irradiance that links of this very element brought, W/m2;
//                    the irradiance of a point is the sum over its ancestors
//
// and per element and node
//
//          gain      the irradiance that its links would bring if all sources
//                    sent 1 W/m2. That of a point is the sum over its
//                    ancestors, and by geometry at most 1: held_gain.h.
//
// Only the cell itself needs it, in its turn as a receiver; where the cell is a
// source, its tree does, and may grow meanwhile. So there may be fewer elements
// here than in the tree: the others have received nothing.

#pragma once

#include "base/block_storage.h"
#include "base/ids.h"
#include "solver/elements/coefficient_array.h"
#include "solver/elements/element_tree.h"

#include <cstdint>

namespace enfilade {

struct ReceivedLight {
  CoefficientArray gathered;
  CoefficientArray gain;

  // Of no element.
  explicit ReceivedLight(const TreeShape& shape)
      : gathered(shape.Stride()), gain(shape.NodeStride()) {}

  // What Save left, and zeros for what has been added since.
  static ReceivedLight Load(const BlockStorage& store,
                            CellId cell,
                            const TreeShape& shape,
                            size_t elements);

  // For reading the solution: what is kept for that (below), or the same
  // without the gains.
  static CoefficientArray LoadGathered(const BlockStorage& store,
                                       CellId cell,
                                       const TreeShape& shape,
                                       size_t elements);

  static uint64_t SaveGathered(BlockStorage& store,
                               CellId cell,
                               const CoefficientArray& gathered);

  // While a cell is refined it has received only a part of its light: what the
  // store has of it is kept for readers until they are told to forget it. Does
  // nothing where some is kept.
  static void KeepForReaders(BlockStorage& store, CellId cell);
  static void ForgetKept(BlockStorage& store, CellId cell);

  // What that of so many elements takes.
  static uint64_t BytesFor(size_t elements, const TreeShape& shape);

  // Returns what it takes in the store.
  uint64_t Save(BlockStorage& store, CellId cell) const;

  void GrowTo(size_t elements) {
    gathered.GrowTo(elements);
    gain.GrowTo(elements);
  }

  void SetZero() {
    gathered.SetZero();
    gain.SetZero();
  }

  [[nodiscard]] uint64_t SizeBytes() const {
    return gathered.SizeBytes() + gain.SizeBytes();
  }

  [[nodiscard]] bool IsFinite() const {
    return gathered.IsFinite() && gain.IsFinite();
  }
};

}  // namespace enfilade
