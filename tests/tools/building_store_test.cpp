// The views of a stored building, and what they take of the budget.

#include "tools/building_store.h"

#include "tests/budgets.h"
#include "tests/tools/solved_rooms.h"
#include <gtest/gtest.h>

namespace enfilade {
namespace {

TEST(StoredBuilding, ItsPortalsAreCharged) {
  MemoryBudget budget(kRoomy);
  StoredBuilding building(SolvedRooms(), budget, Sharing::kAlone);
  const size_t portals = building.View().partition->portals.size();
  ASSERT_GT(portals, 0U);
  EXPECT_GE(budget.UsedBytes(),
            building.WorkBudget().LimitBytes() + portals * sizeof(Portal));
}

}  // namespace
}  // namespace enfilade
