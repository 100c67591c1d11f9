// The light within a cell, iterated until little of it is unsent.
//
// Each step is one of Chebyshev's semi-iteration (semi_iteration.h). Steps come
// in cycles, between which the store may be committed. Where unsent light
// grows, CellBalance first lowers the radius of the semi-iteration and then
// holds the gains (held_gain.h). The cell's row remembers both.
//
// Memory: a cycle needs one more array of coefficients, the step, beside the
// cell's tree and its received light. A cycle does not need the delta. If the
// budget has no room for both arrays, the delta waits in the store. The
// resulting bits are the same either way.

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
  // All arguments are borrowed. The links from the cell to itself must not
  // change while CellBalance works on it. The constructor makes the delta cover
  // all elements.
  CellBalance(const BalancedCell& cell,
              const SurfaceTable& surfaces,
              CellPager& pager,
              BlockStorage& store,
              SolveTimes* times);

  // Runs some steps. Returns true if at most `tolerance`, W, is unsent, false
  // if another cycle should follow.
  bool RunCycle(double tolerance);

  struct Light {
    double leaving = 0;  // flux of the cell's surfaces, E + rho H, W
    double unsent = 0;   // part not yet sent along links, absolute, W
  };

  // Sums the light over the leaves, from what the cell has gathered.
  [[nodiscard]] Light Sum() const;

 private:
  // How the unsent light changed during a cycle.
  enum class CycleEnd : uint8_t { kSettled, kShrank, kGrew };

  // Receives the radiosity of an element and the unsent part of that radiosity.
  using UnsentVisitor = std::function<void(size_t block,
                                           ElementId e,
                                           std::span<const float> radiosity,
                                           std::span<const float> unsent)>;

  [[nodiscard]] ReflectingCell Reflecting() const;
  // Visits elements as VisitRadiosity does.
  void VisitUnsent(const UnsentVisitor& visit) const;
  void AddIfLeaf(ElementId id,
                 std::span<const float> values,
                 LeafSums* sums) const;
  void HoldGains();
  // Between PutDeltaAside and TakeDeltaBack, `sent` changes and nobody may ask
  // for the delta. StartDelta grows the delta to all elements.
  void StartDelta();
  void PutDeltaAside();
  void TakeDeltaBack();
  CycleEnd Iterate(double tolerance, SemiIteration* iteration);
  // Turns `step` from the previous step into the next one. Returns the unsent
  // light, W.
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
