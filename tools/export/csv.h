// One line per patch: what it is, where it is, and its means.

#pragma once

#include <cstdint>
#include <filesystem>

#include "tools/building_view.h"
#include "tools/export/elements.h"

namespace enfilade {

// Columns: cell, patch, material, emits, area_m2, x0 to z3 (a triangle's last
// corner is empty), radiosity_r to _b, irradiance_r to _b: means over the
// patch. Requires the view's for_each_mean. Returns the number of patches and
// sets *bytes to the size of the file.
uint64_t WriteCsv(const BuildingView& building,
                  const ExportProgress& progress,
                  MemoryBudget& budget,
                  const std::filesystem::path& out,
                  uint64_t* bytes);

}  // namespace enfilade
