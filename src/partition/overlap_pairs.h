// Finds which patches of a cell lie in one another, and which of two is in
// front.

#pragma once

#include "base/vec.h"
#include "partition/overlap_sizes.h"
#include "partition/patch.h"
#include "partition/polygon.h"
#include "scene/box_tree.h"

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace enfilade {

// Overlaps narrower than kNarrowM or smaller than kSmallM2 count as rounding
// errors.
inline constexpr double kNarrowM = 1e-4;
inline constexpr double kSmallM2 = 1e-7;

// The part of `polygon` over `other` (both face along `normal`), narrowed by
// kNarrowM along the edges of `other`; empty if the part is a rounding error.
Polygon OverlapOf(const Polygon& polygon, const Polygon& other, Vec3 normal);

// The area of OverlapOf in m2; 0 if the overlap is a rounding error.
double OverlapArea(const Polygon& polygon, const Polygon& other, Vec3 normal);

// Two patches, given by their numbers, that face the same way and lie in one
// another.
struct OverlapPair {
  uint32_t front = 0;
  uint32_t behind = 0;
  double area_m2 = 0;  // of the overlap
  // How far the front patch lies in front of the other within the overlap, m.
  double least_rise = 0;
  double most_rise = 0;

  // Swaps the roles of the front patch and the one behind.
  void Swap();
};

// The boxes of the patches, each enlarged by kCoincidentM on every side.
BoxTree TreeOf(std::span<const Patch> patches);

// The rank of each patch; the lowest rank is the farthest back. Insides of
// solids rank above all else, then patches that emit above those that do not,
// then those of small surfaces above those of large ones (`surfaces`, by
// RankSurfaces). No two patches have the same rank.
std::vector<uint32_t> RanksFromBack(std::span<const Patch> patches,
                                    std::span<const SurfaceRank> surfaces);

// The two patches as a pair; nullopt if they do not lie in one another.
std::optional<OverlapPair> PairOf(uint32_t front,
                                  uint32_t behind,
                                  std::span<const Patch> patches);

}  // namespace enfilade
