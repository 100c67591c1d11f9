// How much a leaf keeps of what its links bring, where they claim to see more
// than there is.
//
// The gain of a point, the sum of the coefficients of its links, is at most 1
// by geometry. Sampled links scatter about that, most where it is dark; and
// where the product of gain and reflectance exceeds 1 all around, as it may in
// a closed cupboard of white boards, light grows without end. To cut gains that
// are too large and to leave those that are too small makes closed rooms too
// dark, by as much as their light is reflected again and again. Hence gains are
// free as long as the light of a cell settles, and are held the more firmly the
// longer it does not: docs/decisions/0016-held-gains.md.

#pragma once

#include "solver/elements/element_tree.h"
#include "solver/elements/geometry.h"

#include <cstdint>
#include <span>

namespace enfilade {

// How firmly gains are held: at each node of a leaf, the product of
// reflectance, gain and share kept is at most
//
//   0              anything
//   1              1.5
//   2              1.2
//   kFirmHold      (1 + rho) / 2, with which the light of flat leaves settles
//   each beyond    0.7 times as much, until all light does
using HoldLevel = uint32_t;
inline constexpr HoldLevel kFirmHold = 3;
inline constexpr HoldLevel kMostHold = 20;

// For each node of a leaf, the factor of its irradiance, an array like
// `gain` (ReceivedLight); one without elements where leaves keep all.
CoefficientArray HeldShares(const CellTree& tree,
                            const CoefficientArray& gain,
                            std::span<const PatchGeometry> patches,
                            HoldLevel level);

// What HeldShares takes.
uint64_t HeldSharesBytes(const CoefficientArray& gain, HoldLevel level);

// The most that it takes for a tree of so many elements.
uint64_t HeldSharesBytesFor(size_t elements, TreeShape shape);

}  // namespace enfilade
