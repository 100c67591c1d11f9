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

// Furnishes an office or a hall; corridors and stairs stay empty. Pieces stand
// at random places that keep off walls, doors and each other. Each piece is an
// object named after the room. At density 1, an office is to hold 0.29
// workplaces and shelves per square metre and a hall 0.12; a piece for which no
// place is found is left out.
void Furnish(ObjWriter& out,
             const PlanSpace& room,
             double floor_z,
             double density,
             const FurnitureMaterials& materials,
             Random random);

}  // namespace enfilade
