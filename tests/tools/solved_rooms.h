// Four furnished rooms with a coarse solution.

#pragma once

#include "base/block_storage.h"
#include "base/memory.h"
#include "partition/partition.h"
#include "scene/import.h"
#include "solver/solve.h"
#include "store/sqlite_store.h"
#include "visibility/ray_tracer.h"
#include "visibility/visible_set.h"

#include <memory>

#include "tests/budgets.h"
#include "tests/temporary_folder.h"
#include "tools/scenes/floorplan.h"

namespace enfilade {

inline std::unique_ptr<BlockStorage> SolveRooms() {
  const TemporaryFolder dir;
  ObjWriter writer(dir / "scene.obj");
  WriteFloorplan({4, 1, 0.5, 1}, writer);
  writer.Finish();
  auto store = CreateStoreInMemory();
  MemoryBudget budget(kRoomy);
  ImportScene(dir / "scene.obj", {}, budget, *store);
  BuildVisibleSets(BuildPartition(*store, {}, budget), {}, budget, *store);
  BuildTraceChunks(*store, budget);
  SolveOptions options;
  options.error = 0.5;
  Solve(*store, options, budget);
  return store;
}

// Solved once for all tests of a program.
inline const BlockStorage& SolvedRooms() {
  static const std::unique_ptr<BlockStorage> solved = SolveRooms();
  return *solved;
}

}  // namespace enfilade
