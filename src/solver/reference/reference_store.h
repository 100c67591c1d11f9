// How reference methods leave their solution in a store: the element trees of
// all cells, and a row of the solve's state for each.

#pragma once

#include "base/block_storage.h"
#include "solver/elements/element_tree.h"
#include "solver/reference/reference_scene.h"
#include "solver/state/solve_state.h"

#include <vector>

namespace enfilade {

// Sets the state's cells and mean reflected radiosity from the trees. Returns
// the area of all reflecting patches, m2.
double TakeCellRows(const ReferenceScene& scene,
                    const std::vector<CellTree>& trees,
                    SolveState* state);

// Writes the trees and the irradiance that they have gathered, both by cell,
// and the state; then commits.
void WriteSolution(const std::vector<CellTree>& trees,
                   const std::vector<CoefficientArray>& gathered,
                   const SolveState& state,
                   BlockStorage& store);

}  // namespace enfilade
