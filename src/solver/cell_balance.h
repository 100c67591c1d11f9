// The light within a cell, iterated until little of it is unsent.
//
// Steps are of Chebyshev's semi-iteration (semi_iteration.h) and come in
// cycles, between which the store may be committed. Where unsent light grows,
// the semi-iteration's radius yields first and then the gains are held
// (held_gain.h): both are remembered in the cell's row.

#pragma once

#include "base/memory.h"
#include "solver/cell_pager.h"
#include "solver/element_tree.h"
#include "solver/push_pull.h"
#include "solver/received_light.h"
#include "solver/semi_iteration.h"
#include "solver/solve_state.h"

namespace enfilade {

struct BalancedCell {
  CellId id;
  const CellGeometry* geometry = nullptr;
  CellTree* tree = nullptr;
  ReceivedLight* received = nullptr;
  CellRow* row = nullptr;
};

class CellBalance {
 public:
  // All are borrowed. The links that the cell has with itself must not change
  // while it is balanced.
  CellBalance(const BalancedCell& cell,
              const SurfaceTable& surfaces,
              CellPager& pager,
              SolveTimes* times);

  // Some steps. True if no more than `tolerance`, W, is unsent; false if there
  // should be another cycle.
  bool RunCycle(double tolerance);

  // E + rho H of what the cell has gathered, as its leaves keep it.
  [[nodiscard]] CoefficientArray Radiosity() const;

 private:
  // How the unsent light fared in some steps.
  enum class CycleEnd : uint8_t { kSettled, kShrank, kGrew };

  CycleEnd Iterate(double tolerance, SemiIteration* iteration);
  void HoldGains();

  BalancedCell cell_;
  const SurfaceTable* surfaces_;
  CellPager* pager_;
  SolveTimes* times_;
  CoefficientArray kept_{1};  // shares that leaves keep
  MemoryCharge kept_charge_;
  MemoryCharge work_charge_;
};

}  // namespace enfilade
