// Lamps for models that have none: flat panels under the ceilings.

#pragma once

#include "base/block_storage.h"
#include "base/memory.h"
#include "scene/face.h"
#include "scene/scene_store.h"

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace enfilade {

// The material of the panels: about 20 W (500 lm) per square metre of floor.
Material DefaultLuminaireMaterial(bool photometric);

struct LuminaireInput {
  bool has_spaces = false;            // gbXML: ceilings know their room
  bool y_is_up = false;               // z is, if not
  std::span<const Opening> openings;  // no panel hangs across an opening
  MaterialId material;
};

// Lays 0.6 x 0.6 m panels 3 cm below ceilings, 2.4 m apart, with at least one
// in every room where one fits. A ceiling is a nearly level face, wound either
// way, with 1.2 m of free height and a floor 1.8 to 15 m below: this takes the
// undersides of slabs, but not their insides. Two panels that walls hide from
// each other may be closer. The result depends only on the faces in the store
// and their order. Charges the budget about 200 bytes for each large face, more
// for one that spans many cells of the plan, and about as much for each panel.
// Hands out the panels once all places are found, and returns their number.
uint64_t LayDefaultLuminaires(const BlockStorage& store,
                              const LuminaireInput& input,
                              MemoryBudget& budget,
                              const FaceVisitor& lay);

}  // namespace enfilade
