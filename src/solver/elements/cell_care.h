// How much more carefully than others the light of a patch is gathered. The
// oracle holds the error of each link to tau, and so the errors of all links
// alike: the best that can be done if links err independently. Where they do
// not, as between a wall and sixty facets of a bowl beside it, a patch is worse
// than the sum of its links says. The residual (residual_check.h) knows such
// patches, and their links are held to tau / care from then on.
//
// The links of a given number err least together where the squared error per
// link is the same everywhere; that is what care tends to. Where the patch is,
// and not why, is all that needs to be known.

#pragma once

#include "base/block_storage.h"
#include "base/ids.h"
#include "base/packed.h"

#include <cstdint>
#include <span>
#include <vector>

namespace enfilade {

// The power of the error that tau is: the error falls a little slower than the
// root of tau, and the slower the more of it is shadows.
inline constexpr double kTauPerError = 2.6;

struct PatchCare {
  float care = 1;      // at least 1; tau over that of the patch's links
  uint32_t links = 0;  // that it has received in this round
};

template <>
inline constexpr bool kIsPacked<PatchCare> = sizeof(PatchCare) ==
                                             sizeof(float) + sizeof(uint32_t);

using CellCare = std::vector<PatchCare>;  // by PatchId

// The care of a cell's patches; 1 for all if none is stored.
// DamagedStoreError if it is of another number of patches.
CellCare LoadCellCare(const BlockStorage& store, CellId cell, size_t patches);

void SaveCellCare(std::span<const PatchCare> care,
                  CellId cell,
                  BlockStorage& store);

// Errors that are known together: an integral of squares, and the links that
// brought them.
struct LinkErrors {
  double square = 0;  // W^2/m2
  double links = 0;
};

// The squared error per link that no patch may exceed if the squares of all,
// those whose patches are known and the rest, are to fall to the share `left`
// of what they are. Infinite where they need not fall.
double LevelOfErrors(std::span<const LinkErrors> known,
                     const LinkErrors& rest,
                     double left);

// By how much tau is to be lowered for errors to come down to a level; 1 for
// those below it.
double RaiseOfCare(const LinkErrors& errors, double level);

// Raises the care of the patches of a cell above a level, by what is wanted
// beyond `by_tau`, which tau itself is lowered by. `square`: by patch, 0 where
// it is not known. Returns what will be gone of the squares once links are made
// anew at the same tau.
double RaiseCare(std::span<const float> square,
                 double level,
                 double by_tau,
                 CellCare* care);

}  // namespace enfilade
