// Quadrature rules for means over the unit square [0,1]^2 and the unit
// triangle: the weights of a rule sum to 1.

#pragma once

#include "partition/patch.h"

#include <cstddef>
#include <vector>

namespace enfilade {

// A point of the unit square [0,1]^2 or the unit triangle a, b >= 0, a+b <= 1.
struct UnitPoint {
  double a = 0;
  double b = 0;
};

struct QuadratureRule {
  std::vector<UnitPoint> nodes;
  std::vector<double> weights;  // all positive
};

// The rule for a basis of order 1 to 4. On the square: the tensor product of
// Gauss-Legendre rules of `order` points, exact to degree 2 order - 1 in each
// variable. On the triangle: a symmetric rule of 1, 3, 6 or 12 points, exact to
// degree 2 (order - 1).
QuadratureRule RuleOfOrder(PatchShape shape, size_t order);

}  // namespace enfilade
