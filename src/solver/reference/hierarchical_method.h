// Hierarchical wavelet radiosity as Willmott and Heckbert ran it (1997, 2.4):
// in core, without clusters of patches, with links refined until an oracle
// finds none worse than epsilon. The solver's own choices are compared with
// this method; the solver itself is solver/engine.h.
//
//   paper        here                       unit
//   B            CellTree::Sent             W/m2
//   H            HierarchicalSolution::gathered  W/m2
//   K V          HierarchicalLink::kernel   irradiance per radiosity
//   epsilon      HierarchicalOptions        by the oracle
//   vis_epsilon  kPartialShare (.cpp)       1
//   edge_min     kLeastEdgeShare (.cpp)     of the longest edge of the scene
//   t_ratio      kChangeRatio (.cpp)        1

#pragma once

#include "base/memory.h"
#include "solver/elements/element_tree.h"
#include "solver/reference/hierarchical_options.h"
#include "solver/reference/panel_solution.h"
#include "solver/reference/reference_scene.h"

#include <cstdint>
#include <vector>

namespace enfilade {

struct HierarchicalSolution {
  std::vector<CellTree> trees;             // radiosity, by cell
  std::vector<CoefficientArray> gathered;  // irradiance, by cell
  uint64_t links = 0;                      // that bring light
  uint64_t passes = 0;
  double residual = 0;   // the last pass's change over the reflected power
  bool complete = true;  // settled within the allowed passes
};

// The trees borrow the basis. Throws DoesNotFitError if the links do not fit
// the budget, which is known only while they are made.
HierarchicalSolution SolveByHierarchy(const ReferenceScene& scene,
                                      const Basis& basis,
                                      const HierarchicalOptions& options,
                                      const RunControl& control,
                                      MemoryBudget& budget);

}  // namespace enfilade
