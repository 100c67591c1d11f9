// Reads gbXML: turns Surfaces into faces, doors, windows and Air surfaces into
// openings, and finds the Spaces on both sides of each. Walls have no
// thickness.

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
// notes to the info. The Spaces' shells, not the file's winding, decide which
// Space is in front of a Surface. Throws InputError with the file and the
// Surface's id, or the line if the XML itself is wrong.
void ReadGbxml(const GbxmlInput& input,
               MaterialTable& materials,
               MemoryBudget& budget,
               SceneWriter& writer,
               SceneInfo& info);

}  // namespace enfilade
