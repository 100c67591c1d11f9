// Furniture from OBJ files, copied beside a generated scene so that the scene
// can name it in instances (docs/instances.md).

#pragma once

#include "base/vec.h"

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace enfilade {

struct PieceOptions {
  std::filesystem::path folder{};  // of OBJ files, with MTL files or without
  // 0: centimetres if any piece is longer than 10 units, otherwise metres.
  double metres_per_unit = 0;
  bool z_is_up = false;  // otherwise Y is, and fronts look towards +Z
};

// A copy of a piece: metres, Z up, rear at -y, the middle of its plan at the
// origin, its lowest point at z = 0.
struct Piece {
  std::string name;            // letters, digits and '-'
  std::filesystem::path file;  // relative to the folder of the scene
  double width = 0, depth = 0, height = 0;  // along x, y, z, metres
  uint64_t polygons = 0;
};

// Sees sentences about what was changed or left out; may be empty.
using NoteSink = std::function<void(const std::string& note)>;

// Copies the pieces into the folder SCENE_pieces beside `scene_obj`, cleaned
// (welded, joined, cut into convex faces). A material without an MTL file gets
// a colour by its name; reflectances above 0.9 become 0.9. Sorted by name.
// One piece at a time is in memory. Throws InputError for a folder that is
// missing or without an OBJ with faces, and for faults of the files, with file
// and line; UsageError for options out of range; DiskError.
std::vector<Piece> CopyPieces(const PieceOptions& options,
                              const std::filesystem::path& scene_obj,
                              const NoteSink& note);

}  // namespace enfilade
