// The light that the elements of one cell have received.
//
//   paper  here      per element, channel and node
//   H      gathered  irradiance that links of this very element brought, W/m2;
//                    the irradiance of a point is the sum over its ancestors
//
//                    per element and node
//          gain      the irradiance that the element's links would bring if all
//                    sources sent 1 W/m2; the gain of a point is the sum over
//                    its ancestors, by geometry at most 1: held_gain.h
//
// The cell needs its received light only in its own turn as a receiver. While
// the cell is a source, only its tree is needed, and the tree may grow. So the
// tree may have more elements than there are here, which have received nothing.

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

  // Light of no elements.
  explicit ReceivedLight(const TreeShape& shape)
      : gathered(shape.Stride()), gain(shape.NodeStride()) {}

  // Loads what Save stored; elements added to the tree since have zeros.
  static ReceivedLight Load(const BlockStorage& store,
                            CellId cell,
                            const TreeShape& shape,
                            size_t elements);

  // The gathered irradiance for reading the solution: that which KeepForReaders
  // kept, if any, else the current one.
  static CoefficientArray LoadGathered(const BlockStorage& store,
                                       CellId cell,
                                       const TreeShape& shape,
                                       size_t elements);

  static uint64_t SaveGathered(BlockStorage& store,
                               CellId cell,
                               const CoefficientArray& gathered);

  // Keeps the stored irradiance of a cell for readers until ForgetKept, because
  // a cell that is being refined has received only a part of its light. Does
  // nothing if an irradiance is already kept.
  static void KeepForReaders(BlockStorage& store, CellId cell);
  static void ForgetKept(BlockStorage& store, CellId cell);

  // The bytes that the light of so many elements takes.
  static uint64_t BytesFor(size_t elements, const TreeShape& shape);

  // Returns the bytes that the light takes in the store.
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
