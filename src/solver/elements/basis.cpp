#include "solver/elements/basis.h"

#include "base/check.h"
#include "base/error.h"
#include "partition/patch_points.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

namespace enfilade {
namespace {

// Exponents are small: at most 3.
double Power(double base, int exponent) {
  double power = 1;
  for (int i = 0; i < exponent; ++i) {
    power *= base;
  }
  return power;
}

double Monomial(std::array<int, 2> exponents, UnitPoint p) {
  return Power(p.a, exponents[0]) * Power(p.b, exponents[1]);
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

UnitPoint Mapped(const ChildFrame& frame, UnitPoint p) {
  return {frame.a + frame.scale * p.a, frame.b + frame.scale * p.b};
}

// The k x k equal cells of a shape: boxes row by row; or the triangles between
// k - 1 lines parallel to each edge, those oriented like the whole first.
std::vector<ChildFrame> EqualCells(PatchShape shape, size_t k) {
  const double size = 1.0 / static_cast<double>(k);
  const bool triangle = shape == PatchShape::kTriangle;
  std::vector<ChildFrame> cells;
  for (size_t j = 0; j < k; ++j) {
    for (size_t i = 0; i < (triangle ? k - j : k); ++i) {
      cells.push_back(
          {static_cast<double>(i) * size, static_cast<double>(j) * size, size});
    }
  }
  for (size_t j = 1; triangle && j < k; ++j) {
    for (size_t i = 1; i + j <= k; ++i) {
      cells.push_back({static_cast<double>(i) * size,
                       static_cast<double>(j) * size,
                       -size});
    }
  }
  return cells;
}

// a (rows x inner) times b (inner x columns), row major.
std::vector<double> Product(std::span<const double> a,
                            std::span<const double> b,
                            size_t inner) {
  const size_t rows = a.size() / inner;
  const size_t columns = b.size() / inner;
  std::vector<double> product(rows * columns, 0.0);
  for (size_t i = 0; i < rows; ++i) {
    for (size_t k = 0; k < inner; ++k) {
      for (size_t j = 0; j < columns; ++j) {
        product[i * columns + j] += a[i * inner + k] * b[k * columns + j];
      }
    }
  }
  return product;
}

}  // namespace

ChildFrame FrameOfChild(PatchShape shape, size_t index) {
  if (shape == PatchShape::kTriangle && index == 3) {
    return {0.5, 0.5, -0.5};
  }
  return {(index & 1) != 0 ? 0.5 : 0.0, (index & 2) != 0 ? 0.5 : 0.0, 0.5};
}

ShapeBasis::ShapeBasis(PatchShape shape, BasisKind kind) : shape_(shape) {
  const size_t order = kind.order;
  ENFILADE_CHECK(!kind.flat || order == 2 || order == 3, "flat {}", order);
  if (kind.flat) {
    cells_ = EqualCells(shape, order);
    for (const ChildFrame& cell : cells_) {
      const double middle = CentroidCoordinate(shape);
      nodes_.push_back(Mapped(cell, {middle, middle}));
      weights_.push_back(cell.scale * cell.scale);
    }
  } else {
    QuadratureRule rule = RuleOfOrder(shape, order);
    nodes_ = std::move(rule.nodes);
    weights_ = std::move(rule.weights);
  }
  FindFunctions(order);
  if (kind.flat) {
    FindFlatTransforms(ShapeBasis(shape, {order, false}));
  } else {
    FindNodalTransforms();
  }
}

// If there are as many nodes as monomials, the functions are Lagrange
// functions: coefficient i of function g is delta_gi. If there are more nodes,
// they give the least-squares fit with the nodes' weights: C_gm = w_g sum over
// m' of F_m'g (F W F^T)^-1_m'm, where F_mg are the coefficients of the
// monomials.
void ShapeBasis::FindFunctions(size_t order) {
  const bool triangle = shape_ == PatchShape::kTriangle;
  const int k = static_cast<int>(order);
  for (int j = 0; j < k; ++j) {
    for (int i = 0; i < (triangle ? k - j : k); ++i) {
      exponents_.push_back({i, j});
    }
  }
  const size_t n = NodeCount();
  const size_t functions = exponents_.size();
  ENFILADE_CHECK(functions <= n && n <= kMaxNodes, "{} of {}", functions, n);
  const QuadratureRule rule = RuleOfOrder(shape_, order);
  std::vector<double> of_monomials(functions * n, 0.0);
  for (size_t m = 0; m < functions; ++m) {
    for (size_t i = 0; i < n; ++i) {
      double& value = of_monomials[m * n + i];
      if (cells_.empty()) {
        value = Monomial(exponents_[m], nodes_[i]);
        continue;
      }
      for (size_t q = 0; q < rule.nodes.size(); ++q) {
        value += rule.weights[q] *
                 Monomial(exponents_[m], Mapped(cells_[i], rule.nodes[q]));
      }
    }
  }
  if (functions == n) {
    coefficients_ = Invert(std::move(of_monomials), n);
    return;
  }
  std::vector<double> weighted(n * functions);  // W F^T
  for (size_t m = 0; m < functions; ++m) {
    for (size_t i = 0; i < n; ++i) {
      weighted[i * functions + m] = weights_[i] * of_monomials[m * n + i];
    }
  }
  coefficients_ = Product(weighted,
                          Invert(Product(of_monomials, weighted, n), functions),
                          functions);
}

// The quadrature rule makes the functions orthogonal or, with more nodes than
// functions, act as if they were: the L2 product of function g with any
// function f of the space is w_g f(node_g).
void ShapeBasis::FindNodalTransforms() {
  const size_t n = NodeCount();
  for (size_t c = 0; c < kChildren; ++c) {
    push_[c].resize(n * n);
    pull_[c].resize(n * n);
    const ChildFrame frame = FrameOfChild(shape_, c);
    for (size_t q = 0; q < n; ++q) {
      const auto values = Evaluate(Mapped(frame, nodes_[q]));
      for (size_t g = 0; g < n; ++g) {
        push_[c][q * n + g] = values[g];
        pull_[c][g * n + q] = values[g] * weights_[q] / (4 * weights_[g]);
      }
    }
  }
}

// The transforms go through the nodal basis of the same space: cell means from
// nodal values, and nodal values from cell means.
void ShapeBasis::FindFlatTransforms(const ShapeBasis& nodal) {
  const size_t n = NodeCount();
  const size_t nodes = nodal.NodeCount();
  std::vector<double> means(n * nodes);
  for (size_t i = 0; i < n; ++i) {
    const auto row = CoefficientsOf(nodal, i);
    std::copy_n(
        row.begin(), nodes, means.begin() + static_cast<long>(i * nodes));
  }
  std::vector<double> values(nodes * n);
  for (size_t q = 0; q < nodes; ++q) {
    const auto row = Evaluate(nodal.Node(q));
    std::copy_n(row.begin(), n, values.begin() + static_cast<long>(q * n));
  }
  for (size_t c = 0; c < kChildren; ++c) {
    push_[c] = Product(Product(means, nodal.push_[c], nodes), values, nodes);
    pull_[c] = Product(Product(means, nodal.pull_[c], nodes), values, nodes);
  }
}

std::array<double, kMaxNodes> ShapeBasis::Evaluate(UnitPoint p) const {
  const size_t functions = exponents_.size();
  std::array<double, kMaxNodes> values{};
  for (size_t m = 0; m < functions; ++m) {
    const double monomial = Monomial(exponents_[m], p);
    for (size_t g = 0; g < NodeCount(); ++g) {
      values[g] += coefficients_[g * functions + m] * monomial;
    }
  }
  return values;
}

std::array<double, kMaxNodes> ShapeBasis::CoefficientsOf(
    const ShapeBasis& other, size_t i) const {
  if (cells_.empty()) {
    return other.Evaluate(nodes_[i]);
  }
  // The rule of this order integrates the functions of `other` exactly, also on
  // a cell.
  std::array<double, kMaxNodes> means{};
  const size_t order = static_cast<size_t>(exponents_.back()[1]) + 1;
  const QuadratureRule rule = RuleOfOrder(shape_, order);
  for (size_t q = 0; q < rule.nodes.size(); ++q) {
    const auto values = other.Evaluate(Mapped(cells_[i], rule.nodes[q]));
    for (size_t g = 0; g < other.NodeCount(); ++g) {
      means[g] += rule.weights[q] * values[g];
    }
  }
  return means;
}

// --------------------------------------------------------------- the samples

namespace {

// The shares of a point in the parts of an element that the second-order nodes
// stand for: the quarters of a square, or the thirds of a triangle nearest to
// its corners (1 - a - b, a, b). A point on a border belongs to several parts.
std::array<float, kSampleNodes> SharesOf(PatchShape shape, UnitPoint p) {
  std::array<float, kSampleNodes> shares{};
  constexpr double kTie = 1e-9;
  if (shape == PatchShape::kTriangle) {
    const std::array<double, 3> corner = {1 - p.a - p.b, p.a, p.b};
    const double largest = *std::max_element(corner.begin(), corner.end());
    const auto ties =
        std::count_if(corner.begin(), corner.end(), [&](double c) {
          return c > largest - kTie;
        });
    for (size_t i = 0; i < corner.size(); ++i) {
      shares[i] =
          corner[i] > largest - kTie ? 1.0F / static_cast<float>(ties) : 0.0F;
    }
    return shares;
  }
  const auto upper = [](double x) {
    return x > 0.5 + kTie ? 1.0F : x < 0.5 - kTie ? 0.0F : 0.5F;
  };
  for (size_t i = 0; i < shares.size(); ++i) {
    const float along_a = (i & 1) != 0 ? upper(p.a) : 1 - upper(p.a);
    const float along_b = (i & 2) != 0 ? upper(p.b) : 1 - upper(p.b);
    shares[i] = along_a * along_b;
  }
  return shares;
}

}  // namespace

SampleMap::SampleMap(const ShapeBasis& basis) {
  const ShapeBasis second(basis.Shape(), {2, false});
  for (size_t g = 0; g < basis.NodeCount(); ++g) {
    share[g] = SharesOf(basis.Shape(), basis.Node(g));
    const auto of_second = basis.CoefficientsOf(second, g);
    for (size_t i = 0; i < second.NodeCount(); ++i) {
      from_samples[g][i] = static_cast<float>(of_second[i]);
      to_samples[g][i] = static_cast<float>(basis.Evaluate(second.Node(i))[g]);
    }
  }
}

const Basis& SecondOrderBasis() {
  static const Basis basis(size_t{2});
  return basis;
}

BasisKind BasisNamed(const std::string& name) {
  static const std::array<std::pair<const char*, BasisKind>, 6> known = {
      {{"haar", {1, false}},
       {"m2", {2, false}},
       {"m3", {3, false}},
       {"m4", {4, false}},
       {"f2", {2, true}},
       {"f3", {3, true}}}};
  for (const auto& [known_name, kind] : known) {
    if (name == known_name) {
      return kind;
    }
  }
  throw UsageError(fmt::format(
      "--basis {}: unknown basis; known are haar, m2, m3, m4, f2 and f3",
      name));
}

}  // namespace enfilade
