// gbXML: Surfaces to faces, their Openings and Air to openings, and the Spaces
// on both sides of each. Walls have no thickness.

#pragma once

#include "base/memory.h"
#include "scene/material_table.h"
#include "scene/scene_store.h"

#include <filesystem>

namespace enfilade {

struct GbxmlInput {
  std::filesystem::path path;
  bool strip_spaces = false;  // faces without Spaces, and no openings
};

// Adds the faces to the writer, and spaces, openings, gbxml, input_polygons and
// notes to the info. Which Space is in front of a Surface is found from the
// Spaces' shells and not believed from the file. Throws InputError with file
// and Surface id (or offset, where the XML itself is wrong).
void ReadGbxml(const GbxmlInput& input,
               MaterialTable& materials,
               MemoryBudget& budget,
               SceneWriter& writer,
               SceneInfo& info);

}  // namespace enfilade
