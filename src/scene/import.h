// Import: a scene file to cleaned faces in a store.
//
//   .obj (+ .mtl), .obj.gz   polygons; Kd, Ke, d/Tr
//   .xml, .gbxml, .xml.gz    gbXML; Spaces and Openings
//
// OBJ is streamed: memory is bounded by the budget and not by the file. A gbXML
// file is held whole while it is read, or refused.

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

// Whether the name is that of a scene file, by its extension.
bool IsSceneName(const std::filesystem::path& path);

// Reads `scene` into `store`, which must hold no scene. Throws InputError with
// file and line for anything wrong: no light at all, reflectance >= 1 or < 0,
// NaN, missing or unknown files, indices out of range, and for an OBJ whose
// size is no building's in metres; with `unit` given, whose size cannot be
// solved.
SceneInfo ImportScene(const std::filesystem::path& scene,
                      const ImportOptions& options,
                      MemoryBudget& budget,
                      BlockStorage& store);

// What of a scene must be in memory at once while it is read, whatever the
// budget: nothing of an OBJ. Throws InputError as ImportScene does.
uint64_t BytesToImport(const std::filesystem::path& scene);

// The hash that SceneInfo::source_hash would have: to notice a changed scene.
uint64_t HashSceneFiles(const std::filesystem::path& scene,
                        const ImportOptions& options);

}  // namespace enfilade
