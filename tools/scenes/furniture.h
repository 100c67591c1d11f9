// Desks, chairs and shelves in the rooms of the office building.

#pragma once

#include "base/random.h"

#include <vector>

#include "tools/scenes/layout.h"

namespace enfilade {

struct FurnitureMaterials {
  std::vector<MaterialId> woods;
  std::vector<MaterialId> fabrics;
};

// Furnishes an office or a hall; corridors and stairs stay empty. Pieces are
// placed at random, keep off walls, doors and each other, and are objects named
// after the room; about 0.2 workplaces and shelves per square metre at density
// 1. A piece for which no place is found is left out.
void Furnish(ObjWriter& out,
             const PlanSpace& room,
             double floor_z,
             double density,
             const FurnitureMaterials& materials,
             Random random);

}  // namespace enfilade
