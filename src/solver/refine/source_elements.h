// The source's end of a transfer that is being refined: a patch or an element
// below it, with the radiosity of when the source was last balanced. The
// radiosity is the same however much the tree has grown since.

#pragma once

#include "base/ids.h"
#include "solver/elements/element_tree.h"
#include "solver/elements/geometry.h"
#include "solver/refine/source_weights.h"
#include "solver/transfer/form_factor.h"
#include "solver/transfer/oracle.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace enfilade {

struct SourceElement : RadiantEnd {
  uint32_t patch = 0;
  ElementPath path = kRootPath;
  ElementId element;  // this one, or an ancestor without detail
};

inline float PeakOf(const SourceElement& source) {
  return PeakOf(source.radiosity, source.detail);
}

// The elements of a source cell.
class SourceElements {
 public:
  // Both are borrowed.
  SourceElements(std::span<const PatchGeometry> patches, const CellTree& tree)
      : patches_(patches), tree_(&tree) {}

  [[nodiscard]] SourceElement OfPatch(uint32_t patch) const;
  [[nodiscard]] SourceElement OfChild(const SourceElement& parent,
                                      size_t child) const;

  // The error of an element's nodes where the element lies closest to the
  // receiver, W/m2 of irradiance. `form_factor`: an upper bound, of the whole
  // element.
  [[nodiscard]] float NearestError(const SourceElement& source,
                                   const TransferEnd& receiver,
                                   float form_factor) const;

 private:
  using NodeValues = std::array<float, kTransferNodes>;

  void SetRadiosity(SourceElement* source) const;
  [[nodiscard]] NodeValues Pushed(const NodeValues& parent,
                                  PatchShape shape,
                                  size_t child) const;

  std::span<const PatchGeometry> patches_;
  const CellTree* tree_;
};

}  // namespace enfilade
