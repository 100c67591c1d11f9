// The faces that may split space: what the tree of planes is chosen from.

#pragma once

#include "base/memory.h"
#include "partition/polygon.h"
#include "scene/scene_store.h"

#include <cstdint>
#include <vector>

namespace enfilade {

// Charges of what grows face by face leave at least so much room.
inline constexpr uint64_t kChargeStepBytes = 1 << 20;

struct WallFace {
  Polygon polygon;
  Plane plane;
  double area_m2 = 0;
  MaterialId material;
  // Faces of one group are parallel, and each lies less than a millimetre from
  // the next: the first and the last of many may be farther apart.
  uint32_t plane_group = 0;
};

struct WallFaces {
  std::vector<WallFace> faces;
  // Every face bounds rooms: a building model without furniture (gbXML).
  bool all_split = false;
  Vec3 up{0, 0, 1};
  MemoryCharge charge;  // of the faces
};

// Reads the candidates for splitting: of a gbXML model every surface, and the
// openings that it names; of a soup the faces of at least 0.05 m2 that are not
// luminaires (emitting and small). The up axis is the one that most of the area
// of the faces is square to.
WallFaces GatherWallFaces(const BlockStorage& store,
                          const SceneInfo& info,
                          MemoryBudget& budget);

}  // namespace enfilade
