// The walls of a scene: faces that may split space, from which the tree of
// planes is chosen.

#pragma once

#include "base/memory.h"
#include "partition/wall_fragments.h"
#include "scene/scene_store.h"

namespace enfilade {

// What the choice of a plane needs to know of all walls together.
struct WallRules {
  // Every face bounds rooms: true for a building model without furniture
  // (gbXML).
  bool all_split = false;
  Vec3 up{0, 0, 1};
};

struct Walls {
  FragmentList fragments;  // whole walls
  WallRules rules;
};

// Reads the candidates for splitting. In a gbXML model these are the surfaces
// and the openings that the model names; in a model with Spaces, only surfaces
// between different Spaces. In a soup these are the faces of at least 0.05 m2
// that are not luminaires (emitting and small). The up axis is the scene's.
Walls GatherWalls(const BlockStorage& store,
                  const SceneInfo& info,
                  MemoryBudget& budget,
                  ScratchShelf& shelf);

}  // namespace enfilade
