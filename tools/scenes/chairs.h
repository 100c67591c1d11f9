// Rooms full of chairs: the `complex` and `lights` scenes of Willmott &
// Heckbert 1997, section 3.1, and the white furnace. Chairs stand on a grid,
// moved and turned a little by the seed; they never touch each other or a wall.
// Each throws UsageError for a parameter out of its range.

#pragma once

#include <cstdint>

#include "tools/scenes/obj_writer.h"

namespace enfilade {

// How the room grows with the number of chairs.
enum class ChairScaling {
  kBoth,        // floor and wall areas grow as the number: "the complex scene"
  kHorizontal,  // one square metre of floor per chair, fixed height
  kNone,        // the room of 36 chairs, whatever the number
};

// A room with a floor, a back, a left and a right wall and one light that faces
// down. Its front and top are open. 5 + 27 count polygons.
struct ChairsOptions {
  uint32_t count = 36;  // at least 1
  ChairScaling scaling = ChairScaling::kBoth;
  uint64_t seed = 1;
};

void WriteChairs(const ChairsOptions& options, ObjWriter& out);

// The same room with 12 chairs and `lights` lights, whose areas add up to the
// area of the single light. 328 + lights polygons.
struct LightsOptions {
  uint32_t lights = 4;  // 1 to 10,000
  uint64_t seed = 1;
};

void WriteLights(const LightsOptions& options, ObjWriter& out);

// A closed room in which every face has the same exitance and reflectance, so
// that the radiosity is emission / (1 - reflectance) everywhere. The chairs are
// closed surfaces that hang a little above the floor, so that no part of an
// emitting face lies inside another body. The insides of the chairs are dark
// and see nothing of the room. 6 + 33 count polygons.
struct FurnaceOptions {
  uint32_t count = 9;        // at least 0
  double reflectance = 0.5;  // [0, 1)
  double emission = 1;       // above 0, W/m2
  uint64_t seed = 1;
};

void WriteFurnace(const FurnaceOptions& options, ObjWriter& out);

}  // namespace enfilade
