// The care of a patch: the factor by which the tau of its links is lowered. The
// oracle holds the error of every link to the same tau, which is optimal if
// links err independently. If they do not, as between a wall and sixty facets
// of a bowl beside it, the error of a patch exceeds what the sum over its links
// predicts. The residual (residual_check.h) finds such patches, and from then
// on their links are held to tau / care.
//
// A given number of links has the least total error if the squared error per
// link is the same everywhere. RaiseCare works towards that; it only needs to
// know where the error of a patch is too large, not why.

#pragma once

#include "base/block_storage.h"
#include "base/ids.h"
#include "base/packed.h"

#include <cstdint>
#include <span>
#include <vector>

namespace enfilade {

// Tau is proportional to this power of the error: the error falls a little
// slower than the square root of tau, and slower still the more of it is due to
// shadows.
inline constexpr double kTauPerError = 2.6;

struct PatchCare {
  float care = 1;      // at least 1; the patch's links are held to tau / care
  uint32_t links = 0;  // links that the patch has received in this round
};

template <>
inline constexpr bool kIsPacked<PatchCare> = sizeof(PatchCare) ==
                                             sizeof(float) + sizeof(uint32_t);

using CellCare = std::vector<PatchCare>;  // by PatchId

// The care of a cell's patches; 1 for all if none is stored. Throws
// DamagedStoreError if the stored number of patches differs.
CellCare LoadCellCare(const BlockStorage& store, CellId cell, size_t patches);

void SaveCellCare(std::span<const PatchCare> care,
                  CellId cell,
                  BlockStorage& store);

// An error that is known as a whole: an integral of squares, and the number of
// links that caused it.
struct LinkErrors {
  double square = 0;  // W^2/m2
  double links = 0;
};

// The squared error per link that no patch may exceed if the total squared
// error, that of patches in `known` plus `rest`, is to fall to the share `left`
// of its present value. Infinite if it need not fall.
double LevelOfErrors(std::span<const LinkErrors> known,
                     const LinkErrors& rest,
                     double left);

// The factor by which tau must be lowered for the errors to fall to a level; 1
// if they are already below it.
double RaiseOfCare(const LinkErrors& errors, double level);

// Raises the care of the patches of a cell whose error exceeds `level`. Tau
// itself is lowered by `by_tau`; care provides the rest. `square`: by patch, 0
// where the error is not known. Returns the squared error that will be gone
// once links are made anew at the same tau.
double RaiseCare(std::span<const float> square,
                 double level,
                 double by_tau,
                 CellCare* care);

}  // namespace enfilade
