// The view of a building whose solution is in a store.

#pragma once

#include "base/memory.h"
#include "solver/solution/display_solution.h"

#include <memory>
#include <optional>

#include "tools/building_view.h"

namespace enfilade {

// Below this much free budget, opening two parts in turn with all of it works
// better than keeping both open on a share each.
inline constexpr uint64_t kTurnsBelowBytes = 192ULL << 20;

// How the tracer and the solution divide the memory. Each of them takes as much
// as it is given.
enum class Sharing {
  kShares,  // both stay open, each on a share of what is free
  kTurns,   // when memory is short, opening one closes the other
  kAlone,   // opening one always closes the other, and outputs only stream
};

// Gives the outputs a view of a stored building. Opens the tracer and the
// solution at their first use. If a share turns out too small, the two take
// turns from then on. The constructor sets aside a part of the budget for what
// the outputs themselves hold. The store and the budget must outlive this
// object.
class StoredBuilding {
 public:
  // Throws InputError if the store holds no solution.
  StoredBuilding(const BlockStorage& store,
                 MemoryBudget& budget,
                 Sharing sharing);
  ~StoredBuilding();
  StoredBuilding(const StoredBuilding&) = delete;
  StoredBuilding& operator=(const StoredBuilding&) = delete;

  // Valid as long as this object.
  [[nodiscard]] const BuildingView& View() const { return view_; }

  [[nodiscard]] Solution& OpenSolution();

  // The part of the budget that is set aside for the outputs. The tracer and
  // the solution do not use it.
  [[nodiscard]] MemoryBudget& WorkBudget() { return work_budget_; }

 private:
  void Close();
  void CloseSolution();
  template <typename Call>
  void CallWithin(const Call& call);
  [[nodiscard]] RayTracer& OpenTracer();
  [[nodiscard]] DisplaySolution& OpenShown();
  MemoryBudget& Share(double fraction,
                      std::optional<MemoryBudget>& share,
                      MemoryCharge& charge);

  const BlockStorage* store_;
  MemoryBudget* budget_;
  GrowingCharge portals_charge_;  // charged before the free budget is shared
  SceneInfo scene_;
  MemoryCharge scene_charge_;
  Partition partition_;
  MemoryCharge cells_charge_;
  bool turns_;
  MemoryBudget work_budget_;
  MemoryCharge work_charge_;
  BuildingView view_;
  std::optional<MemoryBudget> tracer_budget_;
  std::optional<MemoryBudget> solution_budget_;
  MemoryCharge tracer_charge_;
  MemoryCharge solution_charge_;
  std::unique_ptr<RayTracer> tracer_;
  std::unique_ptr<Solution> solution_;
  std::unique_ptr<DisplaySolution> shown_;  // of `solution_`
};

}  // namespace enfilade
