#include "solver/basis.h"

#include "base/check.h"
#include "base/error.h"

#include <cmath>
#include <utility>

#include <fmt/format.h>

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
    default: {
      const double h = 0.5 * std::sqrt(0.6);
      return {{0.5 - h, 0.5, 0.5 + h}, {5.0 / 18, 8.0 / 18, 5.0 / 18}};
    }
  }
}

struct Rule2d {
  std::vector<UnitPoint> nodes;
  std::vector<double> weights;
};

Rule2d SquareRule(size_t order) {
  const Rule1d line = GaussRule(order);
  Rule2d rule;
  for (size_t j = 0; j < order; ++j) {
    for (size_t i = 0; i < order; ++i) {
      rule.nodes.push_back({line.nodes[i], line.nodes[j]});
      rule.weights.push_back(line.weights[i] * line.weights[j]);
    }
  }
  return rule;
}

// The three points of barycentric coordinates (1 - 2t, t, t).
void AddOrbit(double t, double weight, Rule2d* rule) {
  rule->nodes.push_back({t, t});
  rule->nodes.push_back({1 - 2 * t, t});
  rule->nodes.push_back({t, 1 - 2 * t});
  rule->weights.insert(rule->weights.end(), 3, weight);
}

// The symmetric rules of degree 1, 2 and 4 with 1, 3 and 6 points. The two
// orbits of the last one follow from its moment equations in closed form.
Rule2d TriangleRule(size_t order) {
  Rule2d rule;
  if (order == 1) {
    rule.nodes = {{1.0 / 3, 1.0 / 3}};
    rule.weights = {1.0};
  } else if (order == 2) {
    AddOrbit(1.0 / 6, 1.0 / 3, &rule);
  } else {
    const double root = std::sqrt(38 - 44 * std::sqrt(0.4));
    const double plus = (8 - std::sqrt(10.0) + root) / 18;
    const double minus = (8 - std::sqrt(10.0) - root) / 18;
    const double w = std::sqrt(213125 - 53320 * std::sqrt(10.0)) / 3720;
    AddOrbit(plus, 1.0 / 6 + w, &rule);
    AddOrbit(minus, 1.0 / 6 - w, &rule);
  }
  return rule;
}

double Monomial(std::array<int, 2> exponents, UnitPoint p) {
  return std::pow(p.a, exponents[0]) * std::pow(p.b, exponents[1]);
}

// Solves for the inverse of the n x n matrix `m` (row major) by elimination
// with pivots.
std::vector<double> Invert(std::vector<double> m, size_t n) {
  std::vector<double> inverse(n * n, 0.0);
  for (size_t i = 0; i < n; ++i) {
    inverse[i * n + i] = 1;
  }
  for (size_t col = 0; col < n; ++col) {
    size_t pivot = col;
    for (size_t row = col + 1; row < n; ++row) {
      if (std::abs(m[row * n + col]) > std::abs(m[pivot * n + col])) {
        pivot = row;
      }
    }
    for (size_t k = 0; k < n; ++k) {
      std::swap(m[col * n + k], m[pivot * n + k]);
      std::swap(inverse[col * n + k], inverse[pivot * n + k]);
    }
    const double scale = 1 / m[col * n + col];
    for (size_t k = 0; k < n; ++k) {
      m[col * n + k] *= scale;
      inverse[col * n + k] *= scale;
    }
    for (size_t row = 0; row < n; ++row) {
      const double factor = m[row * n + col];
      for (size_t k = 0; row != col && k < n; ++k) {
        m[row * n + k] -= factor * m[col * n + k];
        inverse[row * n + k] -= factor * inverse[col * n + k];
      }
    }
  }
  return inverse;
}

}  // namespace

ChildFrame FrameOfChild(PatchShape shape, size_t index) {
  if (shape == PatchShape::kTriangle && index == 3) {
    return {0.5, 0.5, -0.5};
  }
  return {(index & 1) != 0 ? 0.5 : 0.0, (index & 2) != 0 ? 0.5 : 0.0, 0.5};
}

ShapeBasis::ShapeBasis(PatchShape shape, size_t order) {
  ENFILADE_CHECK(order >= 1 && order <= 3, "order {}", order);
  const bool triangle = shape == PatchShape::kTriangle;
  Rule2d rule = triangle ? TriangleRule(order) : SquareRule(order);
  nodes_ = std::move(rule.nodes);
  weights_ = std::move(rule.weights);
  const int k = static_cast<int>(order);
  for (int j = 0; j < k; ++j) {
    for (int i = 0; i < (triangle ? k - j : k); ++i) {
      exponents_.push_back({i, j});
    }
  }
  const size_t n = NodeCount();
  ENFILADE_CHECK(exponents_.size() == n, "{} of {}", exponents_.size(), n);
  // Lagrange functions: sum_m C[g][m] monomial_m(node_i) = delta_gi.
  std::vector<double> vandermonde(n * n);
  for (size_t m = 0; m < n; ++m) {
    for (size_t i = 0; i < n; ++i) {
      vandermonde[m * n + i] = Monomial(exponents_[m], nodes_[i]);
    }
  }
  coefficients_ = Invert(std::move(vandermonde), n);
  for (size_t c = 0; c < kChildren; ++c) {
    push_[c].resize(n * n);
    pull_[c].resize(n * n);
    const ChildFrame frame = FrameOfChild(shape, c);
    for (size_t q = 0; q < n; ++q) {
      const auto values = Evaluate({frame.a + frame.scale * nodes_[q].a,
                                    frame.b + frame.scale * nodes_[q].b});
      for (size_t g = 0; g < n; ++g) {
        push_[c][q * n + g] = values[g];
        pull_[c][g * n + q] = values[g] * weights_[q] / (4 * weights_[g]);
      }
    }
  }
}

std::array<double, kMaxNodes> ShapeBasis::Evaluate(UnitPoint p) const {
  const size_t n = NodeCount();
  std::array<double, kMaxNodes> values{};
  for (size_t m = 0; m < n; ++m) {
    const double monomial = Monomial(exponents_[m], p);
    for (size_t g = 0; g < n; ++g) {
      values[g] += coefficients_[g * n + m] * monomial;
    }
  }
  return values;
}

size_t BasisOrder(const std::string& name) {
  if (name == "haar" || name == "m1") {
    return 1;
  }
  if (name == "m2") {
    return 2;
  }
  if (name == "m3") {
    return 3;
  }
  throw UsageError(fmt::format(
      "--basis {}: unknown basis; known are haar, m1, m2 and m3", name));
}

}  // namespace enfilade
