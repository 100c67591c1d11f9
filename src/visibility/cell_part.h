// What can be seen of a cell from another: a box in it, as coarse as it is
// small to store. Conservative: it is rounded outwards.

#pragma once

#include "base/vec.h"

#include <array>
#include <cstddef>
#include <cstdint>

namespace enfilade {

// Along each axis from `low` to `high`, in 255ths of the cell's bounds. Where
// it reaches the bounds it has no end: patches may stick out of them a little.
// At first all of the cell.
struct CellPart {
  static constexpr uint8_t kEnd = 255;

  std::array<uint8_t, 3> low{0, 0, 0};
  std::array<uint8_t, 3> high{kEnd, kEnd, kEnd};

  bool operator==(const CellPart&) const = default;
};

template <>
inline constexpr bool kIsPacked<CellPart> = sizeof(CellPart) == 6;

// The smallest that holds a box, and a millimetre around it; `bounds` are the
// cell's.
CellPart PartOf(const Box3& bounds, const Box3& box);

// The box of a part, infinite where that has no end.
Box3 BoxOf(const Box3& bounds, const CellPart& part);

}  // namespace enfilade
