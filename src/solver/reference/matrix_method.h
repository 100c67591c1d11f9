// Matrix radiosity (Goral et al. 1984; Willmott and Heckbert 1997, 2.1): all
// form factors between panels, then one linear system per channel.

#pragma once

#include "base/memory.h"
#include "solver/reference/form_factors.h"
#include "solver/reference/linear_solver.h"
#include "solver/reference/panel_solution.h"
#include "solver/reference/reference_scene.h"

#include <vector>

namespace enfilade {

// G_ij = A_i F_ij of all panels, m2. Throws DoesNotFitError, which names the
// least cap, before any work if the budget does not hold the matrix.
ExchangeMatrix MakeExchangeMatrix(const ReferenceScene& scene,
                                  FormFactors& form_factors,
                                  const std::vector<Panel>& panels,
                                  const RunControl& control,
                                  MemoryBudget& budget);

// Scales the row sums of F to 1 for enclosed panels and to at most 1 for
// others, by G_ij <- d_i d_j G_ij, which keeps reciprocity, or by G_ij <- d_i
// G_ij if the matrix is not symmetric. Errors of quadrature and of sampled
// visibility would otherwise make or lose light at every bounce.
void HoldRowSums(const ReferenceScene& scene,
                 const std::vector<Panel>& panels,
                 bool symmetric,
                 ExchangeMatrix* exchange);

PanelSolution SolveByMatrix(const ReferenceScene& scene,
                            FormFactors& form_factors,
                            std::vector<Panel> panels,
                            const LinearOptions& options,
                            const RunControl& control,
                            MemoryBudget& budget);

}  // namespace enfilade
