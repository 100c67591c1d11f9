// The plan of one wing of the office building on one storey, as data: spaces
// with the holes in their walls, and the openings that line those holes.
//
// A space owns a tile, an axis-parallel rectangle of the plan; tiles cover the
// building's outline without overlap. The air of a space is a box inside its
// tile: inner walls lie half on each side of a tile's edge, outer walls wholly
// inside. Lengths are metres, rounded to millimetres.

#pragma once

#include "base/random.h"
#include "base/vec.h"

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "tools/scenes/floorplan.h"
#include "tools/scenes/shapes.h"

namespace enfilade {

inline constexpr double kClearHeight = 2.90;  // floor to ceiling
inline constexpr double kSlab = 0.35;         // ceiling to the next floor
inline constexpr double kStoreyHeight = kClearHeight + kSlab;
inline constexpr double kInnerWall = 0.15;  // thickness
inline constexpr double kOuterWall = 0.35;  // thickness

enum class Side : uint8_t { kWest, kEast, kSouth, kNorth };
inline constexpr std::array<Side, 4> kSides = {
    Side::kWest, Side::kEast, Side::kSouth, Side::kNorth};

inline size_t Index(Side side) {
  return static_cast<size_t>(side);
}

enum class SpaceUse : uint8_t { kOffice, kHall, kCorridor, kStairs };

// A range of the coordinate along a wall.
struct Span1 {
  double low = 0, high = 0;
};

struct PlanWall {
  std::vector<Rect> holes;    // along the wall x height, world coordinates
  std::vector<Rect> windows;  // the windows among `holes`
  std::vector<Span1> facade;  // outdoor parts; empty: an inner wall
};

struct PlanSpace {
  std::string name;
  SpaceUse use{};
  Rect tile;  // x, y
  std::array<PlanWall, 4> walls;
  std::optional<Rect> floor_hole;    // x, y: the stair opening
  std::optional<Rect> ceiling_hole;  // likewise

  PlanWall& Wall(Side side) { return walls[Index(side)]; }

  [[nodiscard]] const PlanWall& Wall(Side side) const {
    return walls[Index(side)];
  }

  // The plan of the space's air: the tile less the thickness of its walls.
  [[nodiscard]] Rect Box() const;
};

// A doorway through the wall between two spaces.
struct PlanDoorway {
  Axis axis{};  // kX or kY: the direction in which the door leads
  double from = 0, to = 0;
  Rect opening;  // along the wall x height
};

struct WingPlan {
  std::vector<PlanSpace> spaces;
  std::vector<PlanDoorway> doorways;
  uint32_t rooms = 0;
};

// The dimensions that all storeys of a wing share. They depend only on the
// options, the wing and its start along y.
struct WingOutline {
  uint32_t wing = 0;
  uint32_t wings = 1;
  bool has_stairs = false;
  bool may_have_hall = false;
  double hall_length = 0;
  double spine_x0 = 0, spine_x1 = 0, end_x = 0;
  double y0 = 0, corridor_y0 = 0, corridor_y1 = 0, y1 = 0;
  double link_y1 = 0;  // far end of the spine's segment past the courtyard
};

uint32_t WingCount(const FloorplanOptions& options);
uint32_t RoomsInWing(const FloorplanOptions& options,
                     uint32_t storey,
                     uint32_t wing);

WingOutline OutlineOfWing(const FloorplanOptions& options,
                          uint32_t wing,
                          double y0);

WingPlan PlanWing(const FloorplanOptions& options,
                  uint32_t storey,
                  const WingOutline& outline);

// Visits the plans of all wings, storey by storey.
void ForEachWing(
    const FloorplanOptions& options,
    const std::function<void(uint32_t storey, const WingPlan&)>& visit);

// Where the flight of stairs runs in the box of a stairs space: its opening in
// the slabs, its extent along x and its start along y.
struct StairRun {
  Rect opening;
  double x0 = 0, x1 = 0, start_y = 0;
};

inline constexpr uint32_t kStairRisers = 18;
inline constexpr double kStairGoing = 0.27;

StairRun RunOfStairs(const Rect& stair_box);

// `value`, in metres, rounded to the nearest millimetre.
double RoundToMillimetre(double value);

// Uniform in the range, rounded to a millimetre.
double Between(Random& random, double low, double high);

}  // namespace enfilade
