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
  // Moves every vertex as it is read; may be empty.
  std::function<Point3(Point3)> place;
  // The material of a name that no material file has. Without it such a name,
  // and a material file that does not exist, are errors.
  std::function<Material(const std::string& name)> unknown_material;
};

struct ObjCounts {
  uint64_t polygons = 0;
  uint64_t clear = 0;  // of them: ignored, their material is clear
  uint64_t lines = 0;  // faces of fewer than three vertices: dropped
};

// Throws InputError with file and line. Borrows everything.
ObjCounts ReadObj(const ObjInput& input,
                  MaterialTable& materials,
                  MemoryBudget& budget,
                  BlockStorage& store,
                  PolygonSink& sink);

}  // namespace enfilade
