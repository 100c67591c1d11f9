// The solution that the matrix and shooting methods return, and its conversion
// to element trees, the form in which all solutions are stored.

#pragma once

#include "solver/elements/basis.h"
#include "solver/reference/reference_scene.h"
#include "solver/state/solve_options.h"

#include <atomic>
#include <functional>
#include <string_view>
#include <vector>

namespace enfilade {

// Panels that cover every patch once, and the irradiance of each.
struct PanelSolution {
  std::vector<Panel> panels;
  std::vector<Rgb> irradiance;  // W/m2, parallel to panels
  uint64_t form_factors = 0;    // computed and not zero
  uint64_t steps = 0;           // iterations of the solver, or shots
  double residual =
      0;  // of the linear system, or light still to come; relative
  // The part of the error that the method itself can see, relative; 0 if none.
  double seen_error = 0;
  // Whether the method reached what was asked within its limits.
  bool complete = true;
};

// Lets a method report its progress and be stopped.
struct RunControl {
  const std::atomic<bool>* stop = nullptr;
  std::function<void(const SolveProgress&)> progress;

  // Throws InterruptedError if a stop was asked for.
  void Check(double fraction, std::string_view part) const;
};

// A solution as trees, by cell, and the irradiance that their elements have
// gathered.
struct TreeSolution {
  std::vector<CellTree> trees;
  std::vector<CoefficientArray> gathered;
};

// Makes one tree per cell, of the constant basis. A panel becomes one or more
// leaves; `gathered` holds their irradiance, Sent() the radiosity of leaves and
// inner elements.
TreeSolution MakeTrees(const ReferenceScene& scene,
                       const Basis& haar,
                       const PanelSolution& solution);

// The integral of (a - b)^2 of the radiosity over all reflecting patches, mean
// of the channels, W^2/m2. Exact for piecewise constant solutions on any two
// trees.
double SquaredDifference(const ReferenceScene& scene,
                         const std::vector<CellTree>& a,
                         const std::vector<CellTree>& b);

}  // namespace enfilade
