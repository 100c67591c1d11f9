// What the elements of a cell reflected when the cell was last balanced: from
// the patches down to the finest elements with known detail. The values are the
// same however much the tree has grown since.

#pragma once

#include "base/ids.h"
#include "solver/elements/cell_care.h"
#include "solver/elements/element_tree.h"
#include "solver/elements/geometry.h"
#include "solver/elements/push_pull.h"

#include <cstddef>
#include <cstdint>
#include <span>

namespace enfilade {

// The reflected light of one element, in its largest channel, times the care of
// its patch, W/m2.
struct ReflectedElement {
  ElementId element;  // this one, or an ancestor without detail
  float mean = 0;     // rho H
  float detail = 0;   // RMS over the element of all finer light
};

class ReflectedLight {
 public:
  // All arguments are borrowed. `care` is by patch; empty: 1 for all.
  ReflectedLight(const CellTree& tree,
                 std::span<const PatchGeometry> patches,
                 const SurfaceTable& surfaces,
                 std::span<const PatchCare> care)
      : tree_(&tree), patches_(patches), surfaces_(&surfaces), care_(care) {}

  [[nodiscard]] ReflectedElement OfPatch(uint32_t patch) const;
  [[nodiscard]] ReflectedElement OfChild(const ReflectedElement& parent,
                                         size_t child) const;

 private:
  [[nodiscard]] ReflectedElement Of(ElementId element) const;

  const CellTree* tree_;
  std::span<const PatchGeometry> patches_;
  const SurfaceTable* surfaces_;
  std::span<const PatchCare> care_;
};

}  // namespace enfilade
