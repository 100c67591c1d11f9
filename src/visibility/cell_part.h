// The part of a cell that can be seen from another cell: a box that is coarse
// so as to be small to store. Conservative: the box is rounded outwards.

#pragma once

#include "base/vec.h"

#include <array>
#include <cstddef>
#include <cstdint>

namespace enfilade {

// The box from `low` to `high` along each axis, in 255ths of the cell's bounds.
// Where the box reaches the bounds it has no end, because patches may stick out
// of the bounds a little. By default the part is the whole cell.
struct CellPart {
  static constexpr uint8_t kEnd = 255;

  std::array<uint8_t, 3> low{0, 0, 0};
  std::array<uint8_t, 3> high{kEnd, kEnd, kEnd};

  bool operator==(const CellPart&) const = default;
};

template <>
inline constexpr bool kIsPacked<CellPart> = sizeof(CellPart) == 6;

// The smallest part that holds `box` and a millimetre around it; `bounds` are
// the bounds of the cell.
CellPart PartOf(const Box3& bounds, const Box3& box);

// The box of a part, infinite where the part has no end.
Box3 BoxOf(const Box3& bounds, const CellPart& part);

}  // namespace enfilade
