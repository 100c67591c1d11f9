// The floor of one room while furniture is placed on it.

#pragma once

#include <vector>

#include "tools/scenes/layout.h"

namespace enfilade {

// Places that are tried for a piece.
inline constexpr int kPlaceAttempts = 40;

// Places rectangles on the floor of one room without overlap: off the walls,
// off each other, and off the metre before each door.
class FloorSpace {
 public:
  // `floor_z`: holes that reach down to it are doors.
  FloorSpace(const PlanSpace& room, double floor_z);

  // Where rectangles may lie at all.
  [[nodiscard]] const Rect& Free() const { return free_; }

  // Takes the rectangle if it is free; false and unchanged otherwise.
  bool Take(const Rect& rect);

 private:
  [[nodiscard]] Rect InFrontOf(Side side, const Rect& hole) const;

  Rect box_;
  Rect free_;
  std::vector<Rect> taken_;
};

}  // namespace enfilade
