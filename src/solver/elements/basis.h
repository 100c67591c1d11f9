// Polynomial bases on the unit square and the unit triangle, in nodal form.
//
//   paper                      here
//   k (vanishing moments)      order; M1 = Haar, M2 bilinear / linear, M3, M4;
//                              F2, F3: flatlets
//   phi_i (scaling functions)  see below; [node]
//   P, two-scale relation      push (parent to child)
//   L, its adjoint             pull (children to parent)
//
// All bases of order k span the same space: on a parallelogram the tensor
// products of polynomials of degree below k (Gortler et al. 1993), on a
// triangle all polynomials of degree below k. They differ in what a coefficient
// is:
//
//   M1 .. M4   the value at a node of a quadrature rule that is exact for
//              products of two basis functions
//   F2, F3     the mean over one of k x k equal cells: boxes, or the triangles
//              that k - 1 lines along each edge make (W, appendix A.1)
//
// If there are as many nodes as functions, the phi_i are the Lagrange
// functions. M4, F2 and F3 have more nodes than functions on triangles (12 for
// 10, 4 for 3, 9 for 6), and their phi_i give the least-squares fit.
// Derivations and rejected options: docs/decisions/0010-nodal-bases.md,
// 0017-higher-orders.md.

#pragma once

#include "partition/patch.h"
#include "solver/elements/quadrature_rule.h"

#include <array>
#include <cstddef>
#include <span>
#include <string>
#include <vector>

namespace enfilade {

inline constexpr size_t kChildren = 4;
inline constexpr size_t kMaxNodes = 16;

// A basis: its order k, and whether its coefficients are means over cells.
struct BasisKind {
  size_t order = 2;
  bool flat = false;

  friend bool operator==(const BasisKind&, const BasisKind&) = default;
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
  // The order is 1 to 4, or 2 or 3 for a flat basis.
  ShapeBasis(PatchShape shape, BasisKind kind);

  [[nodiscard]] PatchShape Shape() const { return shape_; }

  [[nodiscard]] size_t NodeCount() const { return nodes_.size(); }

  // A node or, in a flat basis, the centroid of a cell.
  [[nodiscard]] UnitPoint Node(size_t i) const { return nodes_[i]; }

  // The share of the element's area that a coefficient stands for (of a
  // node: its quadrature weight); sums to 1.
  [[nodiscard]] double Weight(size_t i) const { return weights_[i]; }

  // The cells of a flat basis; empty for other bases.
  [[nodiscard]] std::span<const ChildFrame> Cells() const { return cells_; }

  // The values of the NodeCount() basis functions at `p`.
  [[nodiscard]] std::array<double, kMaxNodes> Evaluate(UnitPoint p) const;

  // Coefficient i in this basis of each function of `other`, which has the same
  // shape and spans no more than this basis.
  [[nodiscard]] std::array<double, kMaxNodes> CoefficientsOf(
      const ShapeBasis& other, size_t i) const;

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
  void FindFunctions(size_t order);
  void FindNodalTransforms();
  void FindFlatTransforms(const ShapeBasis& nodal);

  PatchShape shape_;
  std::vector<UnitPoint> nodes_;
  std::vector<double> weights_;
  std::vector<ChildFrame> cells_;
  std::vector<std::array<int, 2>> exponents_;  // of the monomials
  std::vector<double> coefficients_;           // [node][monomial]
  std::array<std::vector<double>, kChildren> push_;
  std::array<std::vector<double>, kChildren> pull_;
};

// Maps between the nodes of a basis and the samples: the second-order nodes of
// the same shape, at which visibility and the oracle's bounds are sampled.
inline constexpr size_t kSampleNodes = 4;

struct SampleMap {
  using Rows = std::array<std::array<float, kSampleNodes>, kMaxNodes>;

  // [node][sample]: the value of a basis function at a sample.
  Rows to_samples{};
  // [node][sample]: the coefficient, at a node, of the linear function with
  // value 1 at one sample and 0 at the others.
  Rows from_samples{};
  // [node][sample]: the share of a node in the part of the element that a
  // sample stands for; rows sum to 1.
  Rows share{};

  explicit SampleMap(const ShapeBasis& basis);
};

// The bases of one kind on both shapes.
struct Basis {
  BasisKind kind;
  ShapeBasis parallelogram;
  ShapeBasis triangle;
  SampleMap parallelogram_samples;
  SampleMap triangle_samples;

  explicit Basis(BasisKind basis_kind)
      : kind(basis_kind),
        parallelogram(PatchShape::kParallelogram, basis_kind),
        triangle(PatchShape::kTriangle, basis_kind),
        parallelogram_samples(parallelogram),
        triangle_samples(triangle) {}

  explicit Basis(size_t order) : Basis(BasisKind{order, false}) {}

  [[nodiscard]] const ShapeBasis& On(PatchShape shape) const {
    return shape == PatchShape::kTriangle ? triangle : parallelogram;
  }

  [[nodiscard]] const SampleMap& SamplesOn(PatchShape shape) const {
    return shape == PatchShape::kTriangle ? triangle_samples
                                          : parallelogram_samples;
  }

  // Whether transfers are made at the basis's own nodes; transfers of M1 and M2
  // are made at the second-order nodes.
  [[nodiscard]] bool HasOwnNodes() const { return kind.flat || kind.order > 2; }
};

// The second-order basis M2.
const Basis& SecondOrderBasis();

// The basis called "haar", "m2", "m3", "m4", "f2", "f3". Throws
// UsageError, which lists the known names.
BasisKind BasisNamed(const std::string& name);

}  // namespace enfilade
