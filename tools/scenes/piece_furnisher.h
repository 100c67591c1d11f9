// Places pieces of a library in the rooms of the office building.

#pragma once

#include "base/random.h"

#include <cstdint>
#include <vector>

#include "tools/scenes/layout.h"
#include "tools/scenes/piece_library.h"

namespace enfilade {

// The pieces that fit into some empty room of the building; options.note hears
// of the others. Throws InputError if none does.
std::vector<Piece> FittingPieces(const FloorplanOptions& options,
                                 std::vector<Piece> pieces);

// Puts up to `count` pieces, drawn at random, into an office or a hall;
// corridors and stairs stay empty. A piece stands on the floor with its rear
// at a wall, or anywhere at any whole degree; by the rectangles around them
// pieces keep off walls, doors and each other. Each is an object named after
// the room that holds one instance. What finds no place is replaced by another
// draw, a few times.
void FurnishWithPieces(ObjWriter& out,
                       const PlanSpace& room,
                       double floor_z,
                       const std::vector<Piece>& pieces,
                       uint32_t count,
                       Random random);

}  // namespace enfilade
