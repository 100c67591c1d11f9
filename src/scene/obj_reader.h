// Wavefront OBJ and MTL, streamed: only the vertices are kept, in pages that
// spill (spill_vector.h).
//
// Read: v, f (any number of vertices, negative indices, texture and normal
// indices ignored), o, g, usemtl, mtllib; of materials Kd (reflectance), Ke
// (exitance), d and Tr (opacity below 0.5: clear). Everything else is skipped.
// Polygons before any usemtl are grey, 0.5.

#pragma once

#include "base/memory.h"
#include "scene/input_file.h"
#include "scene/material_table.h"
#include "scene/polygon_sink.h"

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace enfilade {

struct ObjInput {
  std::filesystem::path path;
  std::function<void(double fraction)> progress;  // may be empty
};

struct ObjCounts {
  uint64_t polygons = 0;
  uint64_t clear = 0;  // of them: ignored, their material is clear
};

// Throws InputError with file and line. Borrows everything.
ObjCounts ReadObj(const ObjInput& input,
                  MaterialTable& materials,
                  MemoryBudget& budget,
                  BlockStorage& store,
                  PolygonSink& sink);

// The MTL files an OBJ names, as paths, in its order and once each. `file` is
// read to its end; `visit` sees each chunk of its bytes.
std::vector<std::filesystem::path> MaterialFilesOf(
    const std::filesystem::path& obj,
    const std::function<void(std::span<const char>)>& visit);

}  // namespace enfilade
