#include "tools/scenes/floor_space.h"

#include <algorithm>

namespace enfilade {

namespace {

constexpr double kWallGap = 0.03;
constexpr double kDoorClearance = 1.0;
constexpr double kSpacing = 0.05;

}  // namespace

FloorSpace::FloorSpace(const PlanSpace& room, double floor_z)
    : box_(room.Box()) {
  free_ = {box_.u0 + kWallGap,
           box_.u1 - kWallGap,
           box_.v0 + kWallGap,
           box_.v1 - kWallGap};
  for (const Side side : kSides) {
    for (const Rect& hole : room.Wall(side).holes) {
      if (hole.v0 <= floor_z) {
        taken_.push_back(InFrontOf(side, hole));
      }
    }
  }
}

bool FloorSpace::Take(const Rect& rect) {
  const Rect wide = {rect.u0 - kSpacing,
                     rect.u1 + kSpacing,
                     rect.v0 - kSpacing,
                     rect.v1 + kSpacing};
  const bool blocked =
      std::any_of(taken_.begin(), taken_.end(), [&](const Rect& other) {
        return other.Overlaps(wide);
      });
  if (blocked || !free_.Contains(rect)) {
    return false;
  }
  taken_.push_back(rect);
  return true;
}

Rect FloorSpace::InFrontOf(Side side, const Rect& hole) const {
  switch (side) {
    case Side::kWest:
      return {box_.u0, box_.u0 + kDoorClearance, hole.u0, hole.u1};
    case Side::kEast:
      return {box_.u1 - kDoorClearance, box_.u1, hole.u0, hole.u1};
    case Side::kSouth:
      return {hole.u0, hole.u1, box_.v0, box_.v0 + kDoorClearance};
    case Side::kNorth:
      break;
  }
  return {hole.u0, hole.u1, box_.v1 - kDoorClearance, box_.v1};
}

}  // namespace enfilade
