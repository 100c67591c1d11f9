// The defining identities of the bases: orthogonality, the two-scale relation,
// reproduction of polynomials, vanishing moments, the tables of the study.

#include "solver/elements/basis.h"

#include "base/error.h"
#include "base/random.h"

#include <cmath>
#include <functional>
#include <string>
#include <tuple>

#include "tests/solver/print_basis.h"
#include <gtest/gtest.h>

namespace enfilade {

namespace {

using Function = std::function<double(UnitPoint)>;

constexpr double kDoubleRounding = 1e-12;

UnitPoint Mapped(const ChildFrame& frame, UnitPoint p) {
  return {frame.a + frame.scale * p.a, frame.b + frame.scale * p.b};
}

// Mean over the unit shape of a polynomial of degree up to 6 (RuleOfOrder is
// tested below).
double MeanOf(PatchShape shape, const Function& f) {
  const QuadratureRule rule = RuleOfOrder(shape, 4);
  double mean = 0;
  for (size_t q = 0; q < rule.nodes.size(); ++q) {
    mean += rule.weights[q] * f(rule.nodes[q]);
  }
  return mean;
}

UnitPoint RandomPoint(PatchShape shape, Random* random) {
  const UnitPoint p = {random->Next(), random->Next()};
  const bool outside = shape == PatchShape::kTriangle && p.a + p.b > 1;
  return outside ? UnitPoint{1 - p.a, 1 - p.b} : p;
}

Function Monomial(size_t i, size_t j) {
  return [i, j](UnitPoint p) {
    return std::pow(p.a, static_cast<double>(i)) *
           std::pow(p.b, static_cast<double>(j));
  };
}

using ShapeAndKind = std::tuple<PatchShape, BasisKind>;

class ShapeBasisTest : public ::testing::TestWithParam<ShapeAndKind> {
 protected:
  ShapeBasisTest()
      : shape_(std::get<0>(GetParam())),
        kind_(std::get<1>(GetParam())),
        basis_(shape_, kind_) {}

  [[nodiscard]] size_t Count() const { return basis_.NodeCount(); }

  // All monomials of the space that the basis must span.
  [[nodiscard]] std::vector<Function> Monomials() const {
    std::vector<Function> all;
    for (size_t j = 0; j < kind_.order; ++j) {
      for (size_t i = 0; i < kind_.order; ++i) {
        if (shape_ == PatchShape::kParallelogram || i + j < kind_.order) {
          all.push_back(Monomial(i, j));
        }
      }
    }
    return all;
  }

  // True if there are as many functions as coefficients, so that the
  // coefficients are independent.
  [[nodiscard]] bool IsProper() const { return Monomials().size() == Count(); }

  // The coefficients of a function: its values at the nodes, or its means over
  // the cells if the basis is flat.
  [[nodiscard]] std::vector<double> Sample(const Function& f) const {
    std::vector<double> values;
    for (size_t i = 0; i < Count(); ++i) {
      if (!kind_.flat) {
        values.push_back(f(basis_.Node(i)));
        continue;
      }
      const ChildFrame cell = basis_.Cells()[i];
      values.push_back(
          MeanOf(shape_, [&](UnitPoint p) { return f(Mapped(cell, p)); }));
    }
    return values;
  }

  [[nodiscard]] double ValueAt(const std::vector<double>& coefficients,
                               UnitPoint p) const {
    const auto functions = basis_.Evaluate(p);
    double value = 0;
    for (size_t g = 0; g < Count(); ++g) {
      value += coefficients[g] * functions[g];
    }
    return value;
  }

  [[nodiscard]] std::vector<double> Pushed(
      size_t child, const std::vector<double>& parent) const {
    std::vector<double> values(Count());
    for (size_t q = 0; q < Count(); ++q) {
      for (size_t g = 0; g < Count(); ++g) {
        values[q] += basis_.Push(child, q, g) * parent[g];
      }
    }
    return values;
  }

  [[nodiscard]] std::vector<double> Pulled(
      const std::array<std::vector<double>, kChildren>& children) const {
    std::vector<double> values(Count());
    for (size_t c = 0; c < kChildren; ++c) {
      for (size_t g = 0; g < Count(); ++g) {
        for (size_t q = 0; q < Count(); ++q) {
          values[g] += basis_.Pull(c, g, q) * children[c][q];
        }
      }
    }
    return values;
  }

  // Random coefficients in [-1, 1].
  [[nodiscard]] std::vector<double> Anything(uint64_t seed) const {
    Random random(seed);
    std::vector<double> values(Count());
    for (double& v : values) {
      v = 2 * random.Next() - 1;
    }
    return values;
  }

  PatchShape shape_;
  BasisKind kind_;
  ShapeBasis basis_;
};

TEST_P(ShapeBasisTest, PolynomialsAreReproduced) {
  Random random(1);
  for (const Function& f : Monomials()) {
    const auto coefficients = Sample(f);
    for (int k = 0; k < 10; ++k) {
      const UnitPoint p = RandomPoint(shape_, &random);
      EXPECT_NEAR(ValueAt(coefficients, p), f(p), kDoubleRounding);
    }
  }
}

TEST_P(ShapeBasisTest, ThereAreAsManyFunctionsAsTheSpaceHas) {
  // The coefficients of the functions form a projection onto the space. Its
  // trace is the space's dimension; if there are no more coefficients than
  // that, the projection is the identity.
  double trace = 0;
  for (size_t i = 0; i < Count(); ++i) {
    const auto row = basis_.CoefficientsOf(basis_, i);
    trace += row[i];
    for (size_t g = 0; IsProper() && g < Count(); ++g) {
      EXPECT_NEAR(row[g], g == i ? 1 : 0, kDoubleRounding);
    }
  }
  EXPECT_NEAR(trace, static_cast<double>(Monomials().size()), kDoubleRounding);
}

TEST_P(ShapeBasisTest, ValuesAtNodesAreOrthogonalCoordinates) {
  // The L2 product of function g with f is w_g f(node g), so that functions of
  // different nodes are orthogonal and w_g is the squared norm of function g.
  // For the means of a flat basis the product is that only for f = 1.
  const auto products =
      kind_.flat ? std::vector<Function>{Monomial(0, 0)} : Monomials();
  for (const Function& f : products) {
    const auto coefficients = Sample(f);
    for (size_t g = 0; g < Count(); ++g) {
      const double product = MeanOf(
          shape_, [&](UnitPoint p) { return basis_.Evaluate(p)[g] * f(p); });
      EXPECT_NEAR(product, basis_.Weight(g) * coefficients[g], kDoubleRounding);
    }
  }
}

TEST_P(ShapeBasisTest, WeightsGiveTheMean) {
  const auto coefficients = Anything(2);
  double mean = 0;
  double area = 0;
  for (size_t g = 0; g < Count(); ++g) {
    mean += basis_.Weight(g) * coefficients[g];
    area += basis_.Weight(g);
    EXPECT_GT(basis_.Weight(g), 0);
  }
  EXPECT_NEAR(area, 1, kDoubleRounding);
  EXPECT_NEAR(
      mean,
      MeanOf(shape_, [&](UnitPoint p) { return ValueAt(coefficients, p); }),
      kDoubleRounding);
}

TEST_P(ShapeBasisTest, PushIsTheTwoScaleRelation) {
  // The pushed coefficients give the parent's function on the child, even if
  // the parent's coefficients are not those of a polynomial.
  Random random(3);
  const auto parent = Anything(3);
  for (size_t c = 0; c < kChildren; ++c) {
    const auto child = Pushed(c, parent);
    for (int k = 0; k < 10; ++k) {
      const UnitPoint p = RandomPoint(shape_, &random);
      EXPECT_NEAR(ValueAt(child, p),
                  ValueAt(parent, Mapped(FrameOfChild(shape_, c), p)),
                  kDoubleRounding);
    }
  }
}

TEST_P(ShapeBasisTest, PushOfAPolynomialHasItsCoefficients) {
  for (const Function& f : Monomials()) {
    for (size_t c = 0; c < kChildren; ++c) {
      const ChildFrame frame = FrameOfChild(shape_, c);
      const auto pushed = Pushed(c, Sample(f));
      const auto expected =
          Sample([&](UnitPoint p) { return f(Mapped(frame, p)); });
      for (size_t q = 0; q < Count(); ++q) {
        EXPECT_NEAR(pushed[q], expected[q], kDoubleRounding);
      }
    }
  }
}

TEST_P(ShapeBasisTest, PullAfterPushIsTheIdentity) {
  // Pulling what was pushed restores the function, and the coefficients if they
  // are independent.
  const auto parent = Anything(4);
  std::array<std::vector<double>, kChildren> children;
  for (size_t c = 0; c < kChildren; ++c) {
    children[c] = Pushed(c, parent);
  }
  const auto pulled = Pulled(children);
  Random random(4);
  for (int k = 0; k < 10; ++k) {
    const UnitPoint p = RandomPoint(shape_, &random);
    EXPECT_NEAR(ValueAt(pulled, p), ValueAt(parent, p), kDoubleRounding);
  }
  for (size_t g = 0; IsProper() && g < Count(); ++g) {
    EXPECT_NEAR(pulled[g], parent[g], kDoubleRounding);
  }
}

TEST_P(ShapeBasisTest, WhatPullLeavesHasVanishingMoments) {
  // The difference between the children and their projection is orthogonal to
  // every polynomial of the space: the wavelets' vanishing moments.
  std::array<std::vector<double>, kChildren> children;
  for (size_t c = 0; c < kChildren; ++c) {
    children[c] = Anything(10 + c);
  }
  const auto parent = Pulled(children);
  for (const Function& f : Monomials()) {
    double moment = 0;
    for (size_t c = 0; c < kChildren; ++c) {
      const ChildFrame frame = FrameOfChild(shape_, c);
      moment += MeanOf(shape_, [&](UnitPoint p) {
        const UnitPoint at = Mapped(frame, p);
        return (ValueAt(children[c], p) - ValueAt(parent, at)) * f(at);
      });
    }
    EXPECT_NEAR(moment, 0, kDoubleRounding);
  }
}

TEST_P(ShapeBasisTest, ChildrenAndCellsTileTheWhole) {
  double area = 0;
  for (size_t c = 0; c < kChildren; ++c) {
    const double scale = FrameOfChild(shape_, c).scale;
    area += scale * scale;
  }
  EXPECT_DOUBLE_EQ(area, 1.0);
  // Each of many points lies in one cell.
  Random random(5);
  for (int k = 0; kind_.flat && k < 100; ++k) {
    const UnitPoint p = RandomPoint(shape_, &random);
    int inside = 0;
    for (const ChildFrame& cell : basis_.Cells()) {
      const double a = (p.a - cell.a) / cell.scale;
      const double b = (p.b - cell.b) / cell.scale;
      const bool triangle = shape_ == PatchShape::kTriangle;
      inside += a >= 0 && b >= 0 && (triangle ? a + b <= 1 : a <= 1 && b <= 1)
                    ? 1
                    : 0;
    }
    EXPECT_EQ(inside, 1);
  }
}

// ------------------------------------------------------------- the samples

TEST_P(ShapeBasisTest, LinearFunctionsGoFromSamplesToNodesAndBack) {
  const ShapeBasis second(shape_, {2, false});
  const SampleMap map(basis_);
  for (const auto& f : {Monomial(0, 0), Monomial(1, 0), Monomial(0, 1)}) {
    const auto at_nodes = Sample(f);
    for (size_t g = 0; g < Count(); ++g) {
      double value = 0;
      for (size_t i = 0; i < second.NodeCount(); ++i) {
        value +=
            static_cast<double>(map.from_samples[g][i]) * f(second.Node(i));
      }
      EXPECT_NEAR(value, at_nodes[g], 1e-6);
    }
    for (size_t i = 0; kind_.order > 1 && i < second.NodeCount(); ++i) {
      double value = 0;
      for (size_t g = 0; g < Count(); ++g) {
        value += static_cast<double>(map.to_samples[g][i]) * at_nodes[g];
      }
      EXPECT_NEAR(value, f(second.Node(i)), 1e-6);
    }
  }
}

TEST_P(ShapeBasisTest, EverySampleStandsForAsMuchArea) {
  const size_t samples = shape_ == PatchShape::kTriangle ? 3 : 4;
  const SampleMap map(basis_);
  for (size_t i = 0; i < samples; ++i) {
    double area = 0;
    for (size_t g = 0; g < Count(); ++g) {
      area += basis_.Weight(g) * static_cast<double>(map.share[g][i]);
    }
    EXPECT_NEAR(area, 1.0 / static_cast<double>(samples), 1e-6);
  }
}

INSTANTIATE_TEST_SUITE_P(
    AllBases,
    ShapeBasisTest,
    ::testing::Combine(::testing::Values(PatchShape::kParallelogram,
                                         PatchShape::kTriangle),
                       ::testing::Values(BasisKind{1, false},
                                         BasisKind{2, false},
                                         BasisKind{3, false},
                                         BasisKind{4, false},
                                         BasisKind{2, true},
                                         BasisKind{3, true})),
    [](const ::testing::TestParamInfo<ShapeAndKind>& test) {
      const BasisKind kind = std::get<1>(test.param);
      const bool triangle = std::get<0>(test.param) == PatchShape::kTriangle;
      return (kind.flat ? "F" : "M") + std::to_string(kind.order) +
             (triangle ? "OnTriangles" : "OnParallelograms");
    });

// ------------------------------------------------------ the flatlets of 1997

// A table of W, appendix A.1: rows of a one-dimensional push or pull.
using Table = std::vector<std::vector<double>>;

// Checks child (0, 0) of the tensor product, the lower half along both edges,
// or child 3, the upper half.
void ExpectTensorProduct(const ShapeBasis& basis,
                         size_t child,
                         const Table& push,
                         const Table& pull) {
  const size_t k = push.size();
  for (size_t q = 0; q < k * k; ++q) {
    for (size_t g = 0; g < k * k; ++g) {
      EXPECT_NEAR(basis.Push(child, q, g),
                  push[q % k][g % k] * push[q / k][g / k],
                  kDoubleRounding);
      // W prints pulls to six digits.
      EXPECT_NEAR(basis.Pull(child, q, g),
                  pull[q % k][g % k] * pull[q / k][g / k],
                  1e-6);
    }
  }
}

TEST(Flatlets, PushAndPullAreTheTablesOfTheStudy) {
  const ShapeBasis f2(PatchShape::kParallelogram, {2, true});
  ExpectTensorProduct(f2,
                      0,
                      {{1.25, -0.25}, {0.75, 0.25}},
                      {{0.5625, 0.3125}, {-0.0625, 0.1875}});
  ExpectTensorProduct(f2,
                      3,
                      {{0.25, 0.75}, {-0.25, 1.25}},
                      {{0.1875, -0.0625}, {0.3125, 0.5625}});
  const ShapeBasis f3(PatchShape::kParallelogram, {3, true});
  ExpectTensorProduct(
      f3,
      0,
      {{1.375, -0.5, 0.125}, {0.625, 0.5, -0.125}, {0.125, 1.0, -0.125}},
      {{0.583333, 0.291667, 0.125},
       {-0.0833333, 0.25, 0.333333},
       {0.0, -0.0416667, 0.0416667}});
}

// ------------------------------------------------------------ the quadrature

// Mean over the unit shape of a^i b^j, in closed form.
double Moment(PatchShape shape, size_t i, size_t j) {
  if (shape == PatchShape::kTriangle) {
    return 2 * std::tgamma(static_cast<double>(i + 1)) *
           std::tgamma(static_cast<double>(j + 1)) /
           std::tgamma(static_cast<double>(i + j) + 3.0);
  }
  return 1.0 / (static_cast<double>(i + 1) * static_cast<double>(j + 1));
}

TEST(RuleOfOrder, IsExactForProductsOfTwoBasisFunctions) {
  for (const PatchShape shape :
       {PatchShape::kParallelogram, PatchShape::kTriangle}) {
    for (size_t order = 1; order <= 4; ++order) {
      const QuadratureRule rule = RuleOfOrder(shape, order);
      const size_t degree = 2 * (order - 1);
      for (size_t j = 0; j <= degree; ++j) {
        for (size_t i = 0; i <= degree; ++i) {
          if (shape == PatchShape::kTriangle && i + j > degree) {
            continue;
          }
          double sum = 0;
          for (size_t q = 0; q < rule.nodes.size(); ++q) {
            sum += rule.weights[q] * Monomial(i, j)(rule.nodes[q]);
          }
          EXPECT_NEAR(sum, Moment(shape, i, j), kDoubleRounding)
              << order << " " << i << " " << j;
        }
      }
    }
  }
}

TEST(BasisNamed, NamesAreThoseOfThePapers) {
  EXPECT_EQ(BasisNamed("haar"), (BasisKind{1, false}));
  EXPECT_EQ(BasisNamed("m4"), (BasisKind{4, false}));
  EXPECT_EQ(BasisNamed("f3"), (BasisKind{3, true}));
  EXPECT_THROW(BasisNamed("m9"), UsageError);
  EXPECT_THROW(BasisNamed("f4"), UsageError);
}

}  // namespace
}  // namespace enfilade
