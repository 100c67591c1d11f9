// How reference methods leave their solution in a store: the element trees of
// all cells, and a row of the solve's state for each.

#pragma once

#include "base/block_storage.h"
#include "solver/elements/element_tree.h"
#include "solver/reference/reference_scene.h"
#include "solver/state/solve_state.h"

#include <vector>

namespace enfilade {

// The state's cells and mean reflected radiosity become those of the trees.
// Returns the area of what reflects, m2.
double TakeCellRows(const ReferenceScene& scene,
                    const std::vector<CellTree>& trees,
                    SolveState* state);

// Writes trees, what they have gathered, both by cell, and state, and commits.
void WriteSolution(const std::vector<CellTree>& trees,
                   const std::vector<CoefficientArray>& gathered,
                   const SolveState& state,
                   BlockStorage& store);

}  // namespace enfilade
