// Polynomial bases on the unit square and the unit triangle, in nodal form.
//
//   paper                      here
//   k (vanishing moments)      order; M1 = Haar, M2 bilinear / linear, M3 ...
//   phi_i (scaling functions)  Lagrange functions of the quadrature nodes
//   H, two-scale relation      push (parent to child), pull (its adjoint)
//
// The nodes are those of a quadrature rule that is exact for products of two
// basis functions, so the Lagrange functions are orthogonal, and a coefficient
// is the value at its node. The space spanned on a parallelogram is the tensor
// product of Legendre polynomials of Gortler et al. (1993); on a triangle it is
// all polynomials of degree below k. Derivation and the comparison with
// Legendre coefficients: docs/decisions/0010-nodal-bases.md.

#pragma once

#include "partition/patch.h"

#include <array>
#include <cstddef>
#include <span>
#include <string>
#include <vector>

namespace enfilade {

inline constexpr size_t kChildren = 4;
inline constexpr size_t kMaxNodes = 9;

// A point of the unit square [0,1]^2 or the unit triangle a, b >= 0, a+b <= 1.
struct UnitPoint {
  double a = 0;
  double b = 0;
};

// Where child `index` of a split lies in its parent: parent coordinates are
// offset + scale * child coordinates. The middle child of a triangle is turned
// by half a turn (scale < 0).
struct ChildFrame {
  double a = 0;
  double b = 0;
  double scale = 0.5;
};

ChildFrame FrameOfChild(PatchShape shape, size_t index);

// One basis on one shape. Immutable.
class ShapeBasis {
 public:
  // order 1, 2 or 3.
  ShapeBasis(PatchShape shape, size_t order);

  [[nodiscard]] size_t NodeCount() const { return nodes_.size(); }

  [[nodiscard]] UnitPoint Node(size_t i) const { return nodes_[i]; }

  // Quadrature weight of a node: the share of the element's area; sums to 1.
  [[nodiscard]] double Weight(size_t i) const { return weights_[i]; }

  // The values at `p` of the Lagrange functions, NodeCount() of them.
  [[nodiscard]] std::array<double, kMaxNodes> Evaluate(UnitPoint p) const;

  // child_q = sum over g of Push(child, q, g) parent_g: exact restriction.
  [[nodiscard]] double Push(size_t child, size_t q, size_t g) const {
    return push_[child][q * NodeCount() + g];
  }

  // parent_g = sum over children and q of Pull(child, g, q) child_q: the L2
  // projection.
  [[nodiscard]] double Pull(size_t child, size_t g, size_t q) const {
    return pull_[child][g * NodeCount() + q];
  }

 private:
  std::vector<UnitPoint> nodes_;
  std::vector<double> weights_;
  std::vector<std::array<int, 2>> exponents_;  // of the monomials
  std::vector<double> coefficients_;           // [node][monomial]
  std::array<std::vector<double>, kChildren> push_;
  std::array<std::vector<double>, kChildren> pull_;
};

// The bases of one order on both shapes.
struct Basis {
  size_t order;
  ShapeBasis parallelogram;
  ShapeBasis triangle;

  explicit Basis(size_t basis_order)
      : order(basis_order),
        parallelogram(PatchShape::kParallelogram, basis_order),
        triangle(PatchShape::kTriangle, basis_order) {}

  [[nodiscard]] const ShapeBasis& On(PatchShape shape) const {
    return shape == PatchShape::kTriangle ? triangle : parallelogram;
  }
};

// "haar" or "m1", "m2", "m3"; UsageError names the known ones.
size_t BasisOrder(const std::string& name);

}  // namespace enfilade
