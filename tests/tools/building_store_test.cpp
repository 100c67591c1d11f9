// The views of a stored building, and what they take of the budget.

#include "tools/building_store.h"

#include "scene/import.h"
#include "solver/solve.h"
#include "store/sqlite_store.h"
#include "visibility/ray_tracer.h"
#include "visibility/visible_set.h"

#include <memory>

#include "tests/budgets.h"
#include "tests/temporary_folder.h"
#include "tools/scenes/floorplan.h"
#include <gtest/gtest.h>

namespace enfilade {
namespace {

// Four rooms with a coarse solution.
std::unique_ptr<BlockStorage> FourRooms() {
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

TEST(StoredBuilding, ItsPortalsAreCharged) {
  const auto store = FourRooms();
  MemoryBudget budget(kRoomy);
  StoredBuilding building(*store, budget, Sharing::kAlone);
  const size_t portals = building.View().partition->portals.size();
  ASSERT_GT(portals, 0U);
  EXPECT_GE(budget.UsedBytes(),
            building.WorkBudget().LimitBytes() + portals * sizeof(Portal));
}

}  // namespace
}  // namespace enfilade
