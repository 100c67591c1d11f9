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
  bool z_is_up = false;               // otherwise y or z, by the faces
  std::span<const Opening> openings;  // panels don't hang across them
  MaterialId material;
};

struct LuminaireResult {
  std::vector<Face> panels;
  char up_axis = 'z';
};

// Lays 0.6 x 0.6 m panels 3 cm below ceilings, 2.4 m apart and at least one in
// every room where one fits. A ceiling is a nearly level face with 1.2 m of
// free height under it and a floor 1.8 to 15 m below, whichever way it is
// wound: the undersides of slabs, and not their insides. Two panels that walls
// hide from each other may be closer. Deterministic: depends on the faces in
// the store and their order only. Charges the budget about 100 bytes for each
// large face.
LuminaireResult LayDefaultLuminaires(const BlockStorage& store,
                                     const LuminaireInput& input,
                                     MemoryBudget& budget);

}  // namespace enfilade
