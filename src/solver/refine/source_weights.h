// What a cell sends at most: bounds by which the items of work of its pairs are
// found. They are far smaller than the tree that they are made of, and most
// cells that see a source get no links from it: so they are kept beside the
// tree.

#pragma once

#include "base/block_storage.h"
#include "base/ids.h"
#include "base/packed.h"
#include "solver/elements/element_tree.h"
#include "solver/elements/geometry.h"
#include "solver/refine/refine_side.h"
#include "solver/transfer/cell_geometry.h"
#include "solver/transfer/form_factor.h"

#include <array>
#include <cstdint>
#include <vector>

namespace enfilade {

// What a group sends, of the brightest channel, W/m2.
struct GroupWeight {
  float radiosity = 0;
  float spread = 0;  // RMS of what its patches deviate from it

  [[nodiscard]] float Most() const { return radiosity + spread; }
};

template <>
inline constexpr bool kIsPacked<GroupWeight> = sizeof(GroupWeight) ==
                                               2 * sizeof(float);

// What a cell sends at most: the same for all receivers, until it has had its
// next turn.
struct SourceWeights {
  // Per cluster, the largest of its items that are in no group.
  std::vector<float> peaks;         // radiosity, W/m2
  std::vector<float> fluxes;        // radiosity times area, W
  std::vector<GroupWeight> groups;  // as in SourceGroups::All()

  [[nodiscard]] uint64_t SizeBytes() const;

  // An upper bound of what SizeBytes() of a cell of so many patches will be.
  static uint64_t BytesFor(size_t patches);
};

// Of the side of a source, of which all but `sent` is there. What whole patches
// send decides: it is the same after the tree has grown.
SourceWeights WeighSource(const RefineSide& source);

[[nodiscard]] bool HasSourceWeights(const BlockStorage& store, CellId id);

// There must be some. DamagedStoreError if they do not fit the cell.
SourceWeights LoadSourceWeights(const BlockStorage& store,
                                CellId id,
                                const CellGeometry& cell);

// Returns what they take in the store.
uint64_t SaveSourceWeights(BlockStorage& store,
                           CellId id,
                           const SourceWeights& weights);

void EraseSourceWeights(BlockStorage& store, CellId id);

// What an element sends at its transfer nodes, of the brightest channel, W/m2.
std::array<float, kTransferNodes> NodeRadiosity(const CellTree& tree,
                                                ElementId element,
                                                PatchShape patch);

// The largest radiosity of an element, by that at its nodes and by its detail.
float PeakOf(const std::array<float, kTransferNodes>& radiosity, float detail);

}  // namespace enfilade
