// The share of its irradiance that a leaf keeps if its links claim more light
// than geometry allows.
//
// The gain of a point, the sum of the coefficients of its links, is at most 1
// by geometry. Sampled links scatter about the true gain, most in the dark. If
// the product of gain and reflectance exceeds 1 all around, as it may in a
// closed cupboard of white boards, light grows without end. But cutting the
// gains that are too large and leaving those that are too small makes closed
// rooms too dark, and each reflection adds to the loss. Hence gains are free as
// long as the light of a cell settles, and are held more firmly the longer it
// does not: docs/decisions/0016-held-gains.md.

#pragma once

#include "solver/elements/element_tree.h"
#include "solver/elements/geometry.h"

#include <cstdint>
#include <span>

namespace enfilade {

// How firmly gains are held. At each node of a leaf, the product of
// reflectance, gain and kept share is at most
//
//   0              anything
//   1              1.5
//   2              1.2
//   kFirmHold      (1 + rho) / 2, with which the light of flat leaves settles
//   each beyond    0.7 times the level before, until all light settles
using HoldLevel = uint32_t;
inline constexpr HoldLevel kFirmHold = 3;
inline constexpr HoldLevel kMostHold = 20;

// For each node of a leaf, the share of its irradiance that the leaf keeps, as
// an array like `gain` (ReceivedLight); without elements if leaves keep all.
CoefficientArray HeldShares(const CellTree& tree,
                            const CoefficientArray& gain,
                            std::span<const PatchGeometry> patches,
                            HoldLevel level);

// The bytes that HeldShares takes.
uint64_t HeldSharesBytes(const CoefficientArray& gain, HoldLevel level);

// The most bytes that HeldShares takes for a tree of so many elements.
uint64_t HeldSharesBytesFor(size_t elements, TreeShape shape);

}  // namespace enfilade
