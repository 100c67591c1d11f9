// The floor of one room while furniture is placed on it.

#pragma once

#include <vector>

#include "tools/scenes/layout.h"

namespace enfilade {

// How many random places are tried for one piece.
inline constexpr int kPlaceAttempts = 40;

// Places rectangles on the floor of one room without overlap. The rectangles
// keep away from the walls, from each other, and from the first metre in front
// of each door.
class FloorSpace {
 public:
  // Holes in the walls that reach down to `floor_z` count as doors.
  FloorSpace(const PlanSpace& room, double floor_z);

  // The floor within which rectangles may lie.
  [[nodiscard]] const Rect& Free() const { return free_; }

  // Takes the rectangle and returns true if it is free; otherwise changes
  // nothing and returns false.
  bool Take(const Rect& rect);

 private:
  [[nodiscard]] Rect InFrontOf(Side side, const Rect& hole) const;

  Rect box_;
  Rect free_;
  std::vector<Rect> taken_;
};

}  // namespace enfilade
