// Which patches of a cell lie in one another, and which of two is in front.

#pragma once

#include "base/vec.h"
#include "partition/patch.h"
#include "partition/polygon.h"
#include "scene/box_tree.h"

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace enfilade {

// Overlaps narrower than this, or smaller than that, are rounding.
inline constexpr double kNarrowM = 1e-4;
inline constexpr double kSmallM2 = 1e-7;

// The part of `polygon` over `other` (both face along `normal`), a little less
// at its rim; empty where that is rounding.
Polygon OverlapOf(const Polygon& polygon, const Polygon& other, Vec3 normal);

// Its area in m2; 0 where that is rounding.
double OverlapArea(const Polygon& polygon, const Polygon& other, Vec3 normal);

// Two patches, by their numbers, that face the same way and lie in one another.
struct OverlapPair {
  uint32_t front = 0;
  uint32_t behind = 0;
  double area_m2 = 0;  // of the overlap
  // How far the front one lies before the other there, m.
  double least_rise = 0;
  double most_rise = 0;

  // Takes the one behind for the front one.
  void Swap();
};

// The boxes of the patches, each larger by kCoincidentM on every side.
BoxTree TreeOf(std::span<const Patch> patches);

// The rank of each patch, from back to front: what is not inside of a solid
// before what is, what does not emit before what does, large faces (by their
// area on this side) before small ones. No two have the same.
std::vector<uint32_t> RanksFromBack(std::span<const Patch> patches);

// The two patches as a pair, if they are one.
std::optional<OverlapPair> PairOf(uint32_t front,
                                  uint32_t behind,
                                  std::span<const Patch> patches);

}  // namespace enfilade
