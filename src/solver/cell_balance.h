// The light within a cell, iterated until little of it is unsent.
//
// Steps are of Chebyshev's semi-iteration (semi_iteration.h) and come in
// cycles, between which the store may be committed. Where unsent light grows,
// the semi-iteration's radius yields first and then the gains are held
// (held_gain.h): both are remembered in the cell's row.
//
// Memory: beside the cell's tree and what it has received, one more array of
// coefficients, the step, for the time of a cycle. Meanwhile the delta is not
// needed: if the budget has no room for both, it waits in the store. The bits
// do not depend on it.

#pragma once

#include "base/block_storage.h"
#include "base/memory.h"
#include "solver/elements/coefficient_array.h"
#include "solver/elements/element_tree.h"
#include "solver/elements/push_pull.h"
#include "solver/elements/received_light.h"
#include "solver/paging/cell_pager.h"
#include "solver/semi_iteration.h"
#include "solver/state/solve_state.h"

#include <cstddef>
#include <functional>
#include <span>

namespace enfilade {

struct BalancedCell {
  CellId id;
  const CellGeometry* geometry = nullptr;
  CellTree* tree = nullptr;
  CoefficientArray* delta = nullptr;
  ReceivedLight* received = nullptr;
  CellRow* row = nullptr;
};

class CellBalance {
 public:
  // All are borrowed. The links that the cell has with itself must not change
  // while it is balanced. The delta is of all elements from then on.
  CellBalance(const BalancedCell& cell,
              const SurfaceTable& surfaces,
              CellPager& pager,
              BlockStorage& store,
              SolveTimes* times);

  // Some steps. True if no more than `tolerance`, W, is unsent; false if there
  // should be another cycle.
  bool RunCycle(double tolerance);

  struct Light {
    double leaving = 0;  // the cell's surfaces, E + rho H, W
    double unsent = 0;   // what of it links have not been told of, absolute, W
  };

  // Of what the cell has gathered.
  [[nodiscard]] Light Sum() const;

 private:
  // How the unsent light fared in some steps.
  enum class CycleEnd : uint8_t { kSettled, kShrank, kGrew };

  // With the radiosity of an element and what of it is unsent.
  using UnsentVisitor = std::function<void(size_t block,
                                           ElementId e,
                                           std::span<const float> radiosity,
                                           std::span<const float> unsent)>;

  [[nodiscard]] ReflectingCell Reflecting() const;
  // As VisitRadiosity.
  void VisitUnsent(const UnsentVisitor& visit) const;
  void AddIfLeaf(ElementId id,
                 std::span<const float> values,
                 LeafSums* sums) const;
  void HoldGains();
  // In between, `sent` changes and the delta is not asked for.
  void StartDelta();
  void PutDeltaAside();
  void TakeDeltaBack();
  CycleEnd Iterate(double tolerance, SemiIteration* iteration);
  // Makes the step before into the next one. Returns how much was unsent, W.
  double NextStep(float weight, CoefficientArray* step) const;

  BalancedCell cell_;
  const SurfaceTable* surfaces_;
  CellPager* pager_;
  BlockStorage* store_;
  SolveTimes* times_;
  CoefficientArray kept_{1};  // shares that leaves keep
  MemoryCharge kept_charge_;
  MemoryCharge step_charge_;
  bool is_delta_stored_ = false;
};

}  // namespace enfilade
