// Reads Wavefront OBJ and MTL as a stream: only the vertices are kept, in pages
// that spill to the store (spill_vector.h).
//
// Read: v, f (any number of vertices, negative indices, texture and normal
// indices ignored), o, g, usemtl, mtllib, #instance (instance_line.h); of
// materials Kd (reflectance), Ke (exitance), d and Tr (opacity below 0.5:
// clear), sides (1: the back is black). Everything else is skipped; statements
// that the format does not have, or that call for other files, are counted.
// Polygons before any usemtl are grey, with a reflectance of 0.5, and so are
// materials without Kd that do not emit.

#pragma once

#include "base/memory.h"
#include "scene/input_file.h"
#include "scene/material_table.h"
#include "scene/obj_materials.h"
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
  // Moves the vertices of this file once more, but not those of its instances;
  // may be empty.
  std::function<Point3(Point3)> mend;
  bool without_instances = false;  // pass over #instance lines
  // Asked after each vertex: whether the rest of the file is of no interest;
  // may be empty.
  std::function<bool()> is_enough;
  // Makes the material of a name that no material file has. If this function is
  // empty, such a name is an error unless the override file describes it.
  MaterialMaker unknown_material;
};

struct ObjCounts {
  uint64_t polygons = 0;
  uint64_t clear = 0;         // of the polygons: ignored, for a clear material
  uint64_t lines = 0;         // faces of fewer than three vertices: dropped
  uint64_t unknown = 0;       // statements of unknown kinds
  std::string first_unknown;  // with file and line
  std::string absent;         // the first material file that does not exist
  // Materials that no file has, and the override file describes.
  uint64_t described = 0;
};

// Gives the polygons of the file to the receiver. Throws InputError with file
// and line.
ObjCounts ReadObj(const ObjInput& input,
                  MaterialTable& materials,
                  MemoryBudget& budget,
                  BlockStorage& store,
                  PolygonReceiver& receiver);

}  // namespace enfilade
