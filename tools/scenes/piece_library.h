// Furniture from OBJ files. The files are copied beside a generated scene, so
// that the scene can refer to them by instances (docs/instances.md).

#pragma once

#include "base/vec.h"

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace enfilade {

struct PieceOptions {
  std::filesystem::path folder{};  // of OBJ files; MTL files are optional
  // 0: centimetres if any piece is longer than 10 units, otherwise metres.
  double metres_per_unit = 0;
  bool z_is_up = false;  // false: Y is up and fronts look towards +Z
};

// A copy of a piece, in metres with Z up. The rear of the piece is at -y, the
// middle of its plan at the origin, and its lowest point at z = 0.
struct Piece {
  std::string name;            // letters, digits and '-'
  std::filesystem::path file;  // relative to the folder of the scene
  double width = 0, depth = 0, height = 0;  // along x, y, z, metres
  uint64_t polygons = 0;
};

// Receives a sentence about each thing that was changed or left out; may be
// empty.
using NoteSink = std::function<void(const std::string& note)>;

// Copies the pieces into the folder SCENE_pieces beside `scene_obj` and cleans
// them: vertices are welded, coplanar faces joined and cut into convex faces. A
// material without an MTL file gets a colour by its name; reflectances above
// 0.9 become 0.9. Returns the pieces in the order of their files' names. Memory
// holds one piece at a time. Throws InputError, with file and line, for faults
// in the files, and for a folder that is missing or has no OBJ with faces;
// UsageError for options out of range; DiskError if a copy cannot be written.
std::vector<Piece> CopyPieces(const PieceOptions& options,
                              const std::filesystem::path& scene_obj,
                              const NoteSink& note);

}  // namespace enfilade
