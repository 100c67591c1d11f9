// Repairs a gbXML model's polygons: closes the cracks between them, and drops
// polygons without area.

#pragma once

#include "base/memory.h"
#include "scene/crack_closer.h"
#include "scene/gbxml_model.h"

#include <cstdint>
#include <string>

namespace enfilade {

struct GbxmlRepair {
  CrackSummary cracks;
  uint64_t dropped = 0;       // polygons without area
  std::string first_dropped;  // the Surface of the first of them
};

// Makes surfaces that come within 3 mm of each other touch (crack_closer.h);
// drops surfaces and openings thinner than a millimetre.
GbxmlRepair RepairGbxmlModel(MemoryBudget& budget, GbxmlModel& model);

}  // namespace enfilade
