// Imports an OBJ: looks at its walls, then reads it into the store.

#pragma once

#include "base/block_storage.h"
#include "base/memory.h"
#include "scene/import.h"
#include "scene/material_table.h"
#include "scene/overrides.h"
#include "scene/scene_store.h"

#include <filesystem>

namespace enfilade {

// Where the polygons and materials go, and what is said of materials by name.
struct ObjTarget {
  const Overrides& overrides;
  MaterialTable& materials;
  MemoryBudget& budget;
  BlockStorage& store;
  SceneWriter& writer;
};

// Undoes what rounding did to oblique walls (rounded_walls.h). Adds notes and
// counts to `info`. Throws InputError with file and line, also if there is no
// polygon.
void ImportObj(const std::filesystem::path& scene,
               const ImportOptions& options,
               const ObjTarget& to,
               SceneInfo& info);

}  // namespace enfilade
