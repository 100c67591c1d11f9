// Places pieces of a library in the rooms of the office building.

#pragma once

#include "base/random.h"

#include <cstdint>
#include <vector>

#include "tools/scenes/layout.h"
#include "tools/scenes/piece_library.h"

namespace enfilade {

// Returns the pieces that fit into at least one empty room of the building and
// reports the others to options.note. Throws InputError if no piece fits.
std::vector<Piece> FittingPieces(const FloorplanOptions& options,
                                 std::vector<Piece> pieces);

// Puts up to `count` pieces, drawn at random, into an office or a hall;
// corridors and stairs stay empty. A piece stands on the floor either with its
// rear at a wall or anywhere, turned by any whole number of degrees. The
// bounding rectangles of pieces keep off walls, doors and each other. Each
// piece is an object that is named after the room and holds one instance. If a
// piece finds no place, another is drawn, up to 4 `count` draws in all.
void FurnishWithPieces(ObjWriter& out,
                       const PlanSpace& room,
                       double floor_z,
                       const std::vector<Piece>& pieces,
                       uint32_t count,
                       Random random);

}  // namespace enfilade
