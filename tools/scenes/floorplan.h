// An office building: storeys of offices and halls along corridors, joined by
// stairs, with doorways, windows, ceiling luminaires, desks, chairs, shelves.
//
// Every storey has the same outline. A spine corridor runs along y in segments.
// Wings of at most 16 rooms run from the spine along +x; a wing has a corridor
// between two rows of rooms and in some cases a hall at its end. Open
// courtyards lie between the wings, so that every room has windows. Walls and
// slabs are thick. Apart from the furniture, the faces form a surface without
// gaps that bounds the solid of the building; their fronts look towards the
// air. All doors and windows are open holes with lined reveals.

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
  // If this names a folder, instances of the folder's pieces stand in the rooms
  // instead of desks, chairs and shelves, and `furniture` is ignored.
  PieceOptions pieces{};
  uint32_t pieces_per_room = 5;  // fewer in a room that has no place for more
  NoteSink note{};               // on pieces that are left out; may be empty
};

// One storey for every 1,000 rooms, from 1 to 200 storeys. Up to 200,000 rooms,
// no storey is then longer than a plausible building.
uint32_t UsualStoreys(uint32_t rooms);

// Streams the building storey by storey and wing by wing, so that memory holds
// one wing and one piece at a time. The luminaires emit 33 to 45 W/m2, about
// 10,000 lm/m2 of white light at 300 lm/W, which give some 500 lux on desks.
// Throws UsageError for options out of range, and what CopyPieces and
// FittingPieces throw.
void WriteFloorplan(const FloorplanOptions& options, ObjWriter& out);

}  // namespace enfilade
