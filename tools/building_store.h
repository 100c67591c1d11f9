// The view of a building whose solution is in a store.

#pragma once

#include "base/memory.h"

#include <memory>
#include <optional>

#include "tools/building_view.h"

namespace enfilade {

// With less free budget than this, two shares of it are worth less than turns.
inline constexpr uint64_t kTurnsBelowBytes = 192ULL << 20;

// How the tracer and the solution, each of which takes what memory it gets,
// live beside each other.
enum class Sharing {
  kShares,  // both stay open, each on a share of what is free
  kTurns,   // when memory is short, opening one closes the other
  kAlone,   // opening one always closes the other, and outputs only stream
};

// The tracer and the solution are opened when first used. Shares that turn out
// too small become turns. A part of the budget is set aside at once for what
// the outputs themselves hold. Store and budget must outlive this.
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

  // What is set aside: neither the tracer nor the solution takes of it.
  [[nodiscard]] MemoryBudget& WorkBudget() { return work_budget_; }

 private:
  void Close();
  template <typename Call>
  void CallWithin(const Call& call);
  [[nodiscard]] RayTracer& OpenTracer();
  MemoryBudget& Share(double fraction,
                      std::optional<MemoryBudget>& share,
                      MemoryCharge& charge);

  const BlockStorage* store_;
  MemoryBudget* budget_;
  GrowingCharge portals_charge_;  // before what is free is shared
  SceneInfo scene_;
  Partition partition_;
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
};

}  // namespace enfilade
