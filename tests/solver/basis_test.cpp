// The defining identities of the bases: orthogonality by the quadrature, the
// two-scale relation, reproduction of polynomials, vanishing moments.

#include "solver/basis.h"

#include "base/error.h"

#include <cmath>
#include <functional>
#include <tuple>

#include <gtest/gtest.h>

namespace enfilade {
namespace {

using ShapeAndOrder = std::tuple<PatchShape, size_t>;

class ShapeBasisTest : public testing::TestWithParam<ShapeAndOrder> {
 protected:
  ShapeBasisTest()
      : shape_(std::get<0>(GetParam())),
        order_(std::get<1>(GetParam())),
        basis_(shape_, order_) {}

  // All monomials of the space that the basis must span.
  void ForEachMonomial(
      const std::function<void(const std::function<double(UnitPoint)>&)>& test)
      const {
    for (size_t j = 0; j < order_; ++j) {
      for (size_t i = 0; i < order_; ++i) {
        if (shape_ == PatchShape::kTriangle && i + j >= order_) {
          continue;
        }
        test([i, j](UnitPoint p) {
          return std::pow(p.a, static_cast<double>(i)) *
                 std::pow(p.b, static_cast<double>(j));
        });
      }
    }
  }

  [[nodiscard]] std::vector<double> Sample(
      const std::function<double(UnitPoint)>& f) const {
    std::vector<double> values;
    for (size_t i = 0; i < basis_.NodeCount(); ++i) {
      values.push_back(f(basis_.Node(i)));
    }
    return values;
  }

  // Mean over the unit shape of a^i b^j, in closed form.
  [[nodiscard]] double Moment(size_t i, size_t j) const {
    if (shape_ == PatchShape::kTriangle) {
      return 2 * std::tgamma(static_cast<double>(i + 1)) *
             std::tgamma(static_cast<double>(j + 1)) /
             std::tgamma(static_cast<double>(i + j) + 3.0);
    }
    return 1.0 / (static_cast<double>(i + 1) * static_cast<double>(j + 1));
  }

  PatchShape shape_;
  size_t order_;
  ShapeBasis basis_;
};

constexpr double kRounding = 1e-12;

TEST_P(ShapeBasisTest, LagrangeFunctionsAreOneAtTheirNodeAndZeroAtOthers) {
  for (size_t i = 0; i < basis_.NodeCount(); ++i) {
    const auto values = basis_.Evaluate(basis_.Node(i));
    for (size_t g = 0; g < basis_.NodeCount(); ++g) {
      EXPECT_NEAR(values[g], g == i ? 1 : 0, kRounding);
    }
  }
}

TEST_P(ShapeBasisTest, QuadratureIsExactForProductsOfTwoBasisFunctions) {
  // So the nodes' Lagrange functions are orthogonal, weights are their norms.
  const size_t degree = 2 * (order_ - 1);
  for (size_t j = 0; j <= degree; ++j) {
    for (size_t i = 0; i <= degree; ++i) {
      if (shape_ == PatchShape::kTriangle && i + j > degree) {
        continue;
      }
      double sum = 0;
      for (size_t q = 0; q < basis_.NodeCount(); ++q) {
        sum += basis_.Weight(q) *
               std::pow(basis_.Node(q).a, static_cast<double>(i)) *
               std::pow(basis_.Node(q).b, static_cast<double>(j));
      }
      EXPECT_NEAR(sum, Moment(i, j), kRounding) << i << " " << j;
    }
  }
}

TEST_P(ShapeBasisTest, PushReproducesPolynomials) {
  ForEachMonomial([&](const auto& f) {
    const auto parent = Sample(f);
    for (size_t c = 0; c < kChildren; ++c) {
      const ChildFrame frame = FrameOfChild(shape_, c);
      for (size_t q = 0; q < basis_.NodeCount(); ++q) {
        double value = 0;
        for (size_t g = 0; g < basis_.NodeCount(); ++g) {
          value += basis_.Push(c, q, g) * parent[g];
        }
        EXPECT_NEAR(value,
                    f({frame.a + frame.scale * basis_.Node(q).a,
                       frame.b + frame.scale * basis_.Node(q).b}),
                    kRounding);
      }
    }
  });
}

TEST_P(ShapeBasisTest, PullAfterPushIsTheIdentity) {
  const size_t n = basis_.NodeCount();
  for (size_t g = 0; g < n; ++g) {
    for (size_t h = 0; h < n; ++h) {
      double sum = 0;
      for (size_t c = 0; c < kChildren; ++c) {
        for (size_t q = 0; q < n; ++q) {
          sum += basis_.Pull(c, g, q) * basis_.Push(c, q, h);
        }
      }
      EXPECT_NEAR(sum, g == h ? 1 : 0, kRounding);
    }
  }
}

TEST_P(ShapeBasisTest, WhatPullLeavesHasVanishingMoments) {
  // The difference of children and their projection is orthogonal to every
  // polynomial of the space: the wavelets' vanishing moments.
  const size_t n = basis_.NodeCount();
  std::array<std::vector<double>, kChildren> children;
  for (size_t c = 0; c < kChildren; ++c) {
    for (size_t q = 0; q < n; ++q) {
      children[c].push_back(std::sin(static_cast<double>(7 * c + 3 * q + 1)));
    }
  }
  std::vector<double> parent(n, 0.0);
  for (size_t c = 0; c < kChildren; ++c) {
    for (size_t g = 0; g < n; ++g) {
      for (size_t q = 0; q < n; ++q) {
        parent[g] += basis_.Pull(c, g, q) * children[c][q];
      }
    }
  }
  ForEachMonomial([&](const auto& f) {
    double moment = 0;
    for (size_t c = 0; c < kChildren; ++c) {
      const ChildFrame frame = FrameOfChild(shape_, c);
      for (size_t q = 0; q < n; ++q) {
        double pushed = 0;
        for (size_t g = 0; g < n; ++g) {
          pushed += basis_.Push(c, q, g) * parent[g];
        }
        const UnitPoint at = {frame.a + frame.scale * basis_.Node(q).a,
                              frame.b + frame.scale * basis_.Node(q).b};
        moment += basis_.Weight(q) / 4 * (children[c][q] - pushed) * f(at);
      }
    }
    EXPECT_NEAR(moment, 0, kRounding);
  });
}

TEST_P(ShapeBasisTest, ChildrenTileTheParent) {
  double area = 0;
  for (size_t c = 0; c < kChildren; ++c) {
    const double scale = FrameOfChild(shape_, c).scale;
    area += scale * scale;
  }
  EXPECT_DOUBLE_EQ(area, 1.0);
}

INSTANTIATE_TEST_SUITE_P(
    AllBases,
    ShapeBasisTest,
    testing::Combine(testing::Values(PatchShape::kParallelogram,
                                     PatchShape::kTriangle),
                     testing::Values(size_t{1}, size_t{2}, size_t{3})));

TEST(BasisOrder, UnknownNamesAreUsageErrors) {
  EXPECT_EQ(BasisOrder("haar"), 1U);
  EXPECT_EQ(BasisOrder("m2"), 2U);
  EXPECT_THROW(BasisOrder("m9"), UsageError);
}

}  // namespace
}  // namespace enfilade
