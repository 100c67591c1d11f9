// The view of a building whose solution is in a store.

#pragma once

#include "base/memory.h"

#include <memory>
#include <optional>

#include "tools/building_view.h"

namespace enfilade {

// Its tracer and solution are opened when first
// used. With plenty of memory both stay open and share what is free; with
// little, opening one closes the other. Store and budget must outlive it.
class StoredBuilding {
 public:
  // Throws InputError if the store holds no solution.
  StoredBuilding(const BlockStorage& store, MemoryBudget& budget);
  ~StoredBuilding();
  StoredBuilding(const StoredBuilding&) = delete;
  StoredBuilding& operator=(const StoredBuilding&) = delete;

  // Valid as long as this object.
  [[nodiscard]] const BuildingView& View() const { return view_; }

  [[nodiscard]] Solution& OpenSolution();

 private:
  [[nodiscard]] RayTracer& OpenTracer();
  MemoryBudget& Share(double fraction, std::optional<MemoryBudget>& share);

  const BlockStorage* store_;
  MemoryBudget* budget_;
  bool exclusive_;
  SceneInfo scene_;
  Partition partition_;
  BuildingView view_;
  std::optional<MemoryBudget> tracer_budget_;
  std::optional<MemoryBudget> solution_budget_;
  MemoryCharge tracer_charge_;
  MemoryCharge solution_charge_;
  std::unique_ptr<RayTracer> tracer_;
  std::unique_ptr<Solution> solution_;
};

}  // namespace enfilade
