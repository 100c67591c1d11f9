// An office building: storeys of offices and halls along corridors, joined by
// stairs, with doorways, windows, ceiling luminaires, desks, chairs, shelves.
//
// Plan (the same outline on every storey): a spine corridor along y in
// segments; from it wings of at most 16 rooms run along +x, each with a
// corridor between two rows of rooms and now and then a hall at its end;
// between wings lie open courtyards, so that every room has windows. Walls and
// slabs are thick and closed: the solid of the building is bounded by a surface
// without gaps, fronts towards the air, broken by furniture only. All doors and
// windows are open holes with lined reveals.

#pragma once

#include <cstdint>

#include "tools/scenes/obj_writer.h"
#include "tools/scenes/piece_library.h"

namespace enfilade {

struct FloorplanOptions {
  uint32_t rooms = 60;     // offices and halls; at least one per storey
  uint32_t storeys = 1;    // 1 to 200
  double furniture = 0.5;  // density in [0, 1]
  uint64_t seed = 1;
  // With a folder: its pieces stand in the rooms instead of desks, chairs and
  // shelves, as instances; `furniture` is not looked at.
  PieceOptions pieces{};
  uint32_t pieces_per_room = 5;  // fewer where no more find a place
  NoteSink note{};               // of pieces that are left out; may be empty
};

// One for every 1,000 rooms, so that no storey is longer than a building can
// be.
uint32_t UsualStoreys(uint32_t rooms);

// Streams the building storey by storey, wing by wing: memory is that of one
// wing and of one piece. The luminaires emit 33 to 45 W/m2, about 10,000 lm/m2
// of white light at 300 lm/W: some 500 lux on desks. Throws UsageError for
// options out of range, and what CopyPieces throws.
void WriteFloorplan(const FloorplanOptions& options, ObjWriter& out);

}  // namespace enfilade
