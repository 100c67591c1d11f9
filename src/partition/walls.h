// The walls of a scene: faces that may split space, from which the tree of
// planes is chosen.

#pragma once

#include "base/memory.h"
#include "partition/wall_fragments.h"
#include "scene/scene_store.h"

namespace enfilade {

// What the choice of a plane asks of all walls.
struct WallRules {
  // Every face bounds rooms: a building model without furniture (gbXML).
  bool all_split = false;
  Vec3 up{0, 0, 1};
};

struct Walls {
  FragmentList fragments;  // whole walls
  WallRules rules;
};

// Reads the candidates for splitting: of a gbXML model every surface, and the
// openings that it names; of a soup the faces of at least 0.05 m2 that are not
// luminaires (emitting and small). The up axis is the one that most of the area
// of the faces is square to.
Walls GatherWalls(const BlockStorage& store,
                  const SceneInfo& info,
                  MemoryBudget& budget,
                  ScratchShelf& shelf);

}  // namespace enfilade
