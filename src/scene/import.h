// Import reads a scene file into a store, as cleaned faces.
//
//   .obj (+ .mtl), .obj.gz   polygons; Kd, Ke, d/Tr
//   .xml, .gbxml, .xml.gz    gbXML; Spaces and Openings
//
// An OBJ file is streamed: the budget, not the file, bounds the memory. A gbXML
// file is held whole while it is read; one that does not fit is refused.

#pragma once

#include "base/memory.h"
#include "scene/scene_store.h"

#include <filesystem>
#include <functional>
#include <optional>

namespace enfilade {

struct ImportOptions {
  // JSON: {"materials": {glob: props}, "objects": {...}, "surfaces": {...}},
  // props: reflectance (number or [r,g,b]), exitance, sides, clear.
  std::optional<std::filesystem::path> overrides;
  bool default_luminaires = false;  // emitting panels on ceilings
  bool photometric = false;         // Ke and exitance are lm/m2
  std::optional<int> sides;         // 1 or 2 for every material
  bool strip_spaces = false;        // gbXML: forget Spaces, keep bare polygons
  std::optional<double> unit;       // OBJ: metres per unit of the file
  std::function<void(double fraction)> progress;  // may be empty
};

// Whether the extension of the name is that of a scene file.
bool IsSceneName(const std::filesystem::path& path);

// Reads `scene` into `store`, which must hold no scene. Throws InputError with
// file and line for anything wrong: no light at all, reflectance >= 1 or < 0,
// NaN, missing or unknown files that are needed, indices out of range, and an
// OBJ whose size in metres is no building's or, with `unit` given, too extreme
// to be solved.
SceneInfo ImportScene(const std::filesystem::path& scene,
                      const ImportOptions& options,
                      MemoryBudget& budget,
                      BlockStorage& store);

// The bytes of a scene that must be in memory at once while it is read,
// whatever the budget; 0 for an OBJ. Throws InputError as ImportScene does.
uint64_t BytesToImport(const std::filesystem::path& scene);

struct SceneHash {
  uint64_t value = 0;
  bool is_there = true;  // the scene exists, and the overrides if it has any
  // False if a file that the scene names does not exist, or the scene itself.
  bool is_whole = true;
};

// The value that SceneInfo::source_hash would have, to notice a changed scene.
SceneHash HashSceneFiles(const std::filesystem::path& scene,
                         const ImportOptions& options);

}  // namespace enfilade
