// A row of rooms in a store, for the tests of what pages cells in.

#pragma once

#include "partition/partition.h"
#include "partition/patch.h"
#include "scene/scene_store.h"
#include "store/sqlite_store.h"
#include "visibility/visible_set.h"

#include <cstddef>
#include <cstdint>
#include <memory>

#include "tests/budgets.h"
#include "tests/visibility/test_rooms.h"

namespace enfilade::test {

// Cubes of 1 m in a row. There are doors at alternate ends of the walls: a room
// sees its neighbours only.
struct RowOfRooms {
  std::unique_ptr<BlockStorage> store = CreateStoreInMemory();
  SceneInfo scene;
  Partition partition;

  // All walls of the rooms are of one material.
  explicit RowOfRooms(size_t cells, const Material& material = {}) {
    scene.materials = {material};
    for (size_t i = 0; i < cells; ++i) {
      const auto x = static_cast<double>(i);
      CellPatches room;
      room.bounds = {{x, 0, 0}, {x + 1, 1, 1}};
      room.patches = BoxPatches(room.bounds, true);
      for (Patch& patch : room.patches) {
        patch.material = MaterialId(0U);
        patch.emits = Emits(material);
      }
      CellInfo cell;
      cell.bounds = room.bounds;
      cell.patches = static_cast<uint32_t>(room.patches.size());
      partition.cells.push_back(cell);
      store->Put({BlockKind::kCellPatches, CellId(i).value},
                 EncodeCellPatches(room));
    }
    for (size_t i = 0; i + 1 < cells; ++i) {
      const auto x = static_cast<double>(i + 1);
      const double y = i % 2 == 0 ? 0 : 0.9;
      partition.portals.push_back(
          {CellId(i + 1),
           CellId(i),
           {{x, y, 0}, {x, y + 0.1, 0}, {x, y + 0.1, 0.1}, {x, y, 0.1}}});
    }
    MemoryBudget budget(kModest);
    BuildVisibleSets(partition, {}, budget, *store);
  }
};

}  // namespace enfilade::test
