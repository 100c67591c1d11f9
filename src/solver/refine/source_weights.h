// Bounds of what a cell sends, by which the items of work of its pairs are
// found. The bounds are far smaller than the tree from which they are made, and
// most cells that see a source get no links from it. The bounds are therefore
// kept beside the tree.

#pragma once

#include "base/block_storage.h"
#include "base/ids.h"
#include "base/packed.h"
#include "solver/elements/element_tree.h"
#include "solver/elements/geometry.h"
#include "solver/refine/refine_source.h"
#include "solver/transfer/cell_geometry.h"
#include "solver/transfer/form_factor.h"

#include <array>
#include <cstdint>
#include <vector>

namespace enfilade {

// What a group sends in its brightest channel, W/m2.
struct GroupWeight {
  float radiosity = 0;
  float spread = 0;  // RMS deviation of its patches from `radiosity`

  [[nodiscard]] float Most() const { return radiosity + spread; }
};

template <>
inline constexpr bool kIsPacked<GroupWeight> = sizeof(GroupWeight) ==
                                               2 * sizeof(float);

// Bounds of what a cell sends. They are the same for all receivers until the
// cell's next turn is over.
struct SourceWeights {
  // Per cluster, the largest value of its items that are in no group.
  std::vector<float> peaks;         // radiosity, W/m2
  std::vector<float> fluxes;        // radiosity times area, W
  std::vector<GroupWeight> groups;  // as in SourceGroups::All()

  [[nodiscard]] uint64_t SizeBytes() const;

  // An upper bound of SizeBytes() for a cell with this many patches.
  static uint64_t BytesFor(size_t patches);
};

// Makes the bounds of a source, whose `sent` is not needed. The bounds come
// from what whole patches send, so they are the same after the tree has grown.
SourceWeights WeighSource(const RefineSource& source, const CellTree& tree);

[[nodiscard]] bool HasSourceWeights(const BlockStorage& store, CellId id);

// Requires stored weights. Throws DamagedStoreError if they do not fit the
// cell.
SourceWeights LoadSourceWeights(const BlockStorage& store,
                                CellId id,
                                const CellGeometry& cell);

// Returns the bytes that the weights take in the store.
uint64_t SaveSourceWeights(BlockStorage& store,
                           CellId id,
                           const SourceWeights& weights);

void EraseSourceWeights(BlockStorage& store, CellId id);

// What an element sends at its transfer nodes, in the brightest channel, W/m2.
std::array<float, kTransferNodes> NodeRadiosity(const CellTree& tree,
                                                ElementId element,
                                                PatchShape patch);

// The largest radiosity of an element: the largest at its nodes, plus its
// detail.
float PeakOf(const std::array<float, kTransferNodes>& radiosity, float detail);

}  // namespace enfilade
