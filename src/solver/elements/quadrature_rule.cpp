#include "solver/elements/quadrature_rule.h"

#include "base/check.h"

#include <array>
#include <cmath>

namespace enfilade {
namespace {

struct Rule1d {
  std::vector<double> nodes;
  std::vector<double> weights;
};

// Gauss-Legendre on [0,1] with n points: exact to degree 2n - 1.
Rule1d GaussRule(size_t n) {
  switch (n) {
    case 1:
      return {{0.5}, {1.0}};
    case 2: {
      const double h = 0.5 / std::sqrt(3.0);
      return {{0.5 - h, 0.5 + h}, {0.5, 0.5}};
    }
    case 3: {
      const double h = 0.5 * std::sqrt(0.6);
      return {{0.5 - h, 0.5, 0.5 + h}, {5.0 / 18, 8.0 / 18, 5.0 / 18}};
    }
    default: {
      // The roots of the Legendre polynomial 35 x^4 - 30 x^2 + 3.
      const double root = 2.0 / 7 * std::sqrt(1.2);
      const double inner = 0.5 * std::sqrt(3.0 / 7 - root);
      const double outer = 0.5 * std::sqrt(3.0 / 7 + root);
      const double w = std::sqrt(30.0) / 72;
      return {{0.5 - outer, 0.5 - inner, 0.5 + inner, 0.5 + outer},
              {0.25 - w, 0.25 + w, 0.25 + w, 0.25 - w}};
    }
  }
}

QuadratureRule SquareRule(size_t order) {
  const Rule1d line = GaussRule(order);
  QuadratureRule rule;
  for (size_t j = 0; j < order; ++j) {
    for (size_t i = 0; i < order; ++i) {
      rule.nodes.push_back({line.nodes[i], line.nodes[j]});
      rule.weights.push_back(line.weights[i] * line.weights[j]);
    }
  }
  return rule;
}

// The three points of barycentric coordinates (1 - 2t, t, t).
void AddOrbit(double t, double weight, QuadratureRule* rule) {
  rule->nodes.push_back({t, t});
  rule->nodes.push_back({1 - 2 * t, t});
  rule->nodes.push_back({t, 1 - 2 * t});
  rule->weights.insert(rule->weights.end(), 3, weight);
}

// The six points of barycentric coordinates s, t, 1 - s - t in any order.
void AddFullOrbit(double s, double t, double weight, QuadratureRule* rule) {
  const std::array<double, 3> at = {s, t, 1 - s - t};
  for (size_t i = 0; i < 3; ++i) {
    for (size_t k = 0; k < 3; ++k) {
      if (i != k) {
        rule->nodes.push_back({at[i], at[k]});
        rule->weights.push_back(weight);
      }
    }
  }
}

// The symmetric rules of degree 1, 2, 4 and 6. The two orbits of degree 4
// follow from its moment equations in closed form; the orbits of degree 6
// (Dunavant 1985) satisfy theirs to the last digits.
QuadratureRule TriangleRule(size_t order) {
  QuadratureRule rule;
  if (order == 1) {
    rule.nodes = {{1.0 / 3, 1.0 / 3}};
    rule.weights = {1.0};
  } else if (order == 2) {
    AddOrbit(1.0 / 6, 1.0 / 3, &rule);
  } else if (order == 3) {
    const double root = std::sqrt(38 - 44 * std::sqrt(0.4));
    const double plus = (8 - std::sqrt(10.0) + root) / 18;
    const double minus = (8 - std::sqrt(10.0) - root) / 18;
    const double w = std::sqrt(213125 - 53320 * std::sqrt(10.0)) / 3720;
    AddOrbit(plus, 1.0 / 6 + w, &rule);
    AddOrbit(minus, 1.0 / 6 - w, &rule);
  } else {
    AddOrbit(0.24928674517091042, 0.11678627572637937, &rule);
    AddOrbit(0.06308901449150223, 0.05084490637020682, &rule);
    AddFullOrbit(
        0.05314504984481695, 0.31035245103378441, 0.08285107561837358, &rule);
  }
  return rule;
}

}  // namespace

QuadratureRule RuleOfOrder(PatchShape shape, size_t order) {
  ENFILADE_CHECK(order >= 1 && order <= 4, "order {}", order);
  return shape == PatchShape::kTriangle ? TriangleRule(order)
                                        : SquareRule(order);
}

}  // namespace enfilade
