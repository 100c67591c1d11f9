// What the hierarchical method chooses between, one choice at a time: where two
// elements touch, transfers between flatlets, and the oracles.

#include "base/error.h"
#include "solver/reference/form_factor_kinds.h"
#include "solver/reference/hierarchical_oracle.h"
#include "solver/reference/hierarchical_transfer.h"

#include <array>
#include <cmath>
#include <vector>

#include "tests/solver/test_cells.h"
#include <gtest/gtest.h>

namespace enfilade {
namespace {

using test::kFloatRounding;

Patch PatchOf(Point3 origin, Vec3 u, Vec3 v) {
  Patch patch;
  patch.origin = origin;
  patch.u = u;
  patch.v = v;
  return patch;
}

// The unit square at z = 0 that looks up, and one that stands on the line
// x = -`gap` and looks along x.
std::vector<PatchGeometry> RightAngle(double gap) {
  return test::GeometryOf({PatchOf({0, 0, 0}, {1, 0, 0}, {0, 1, 0}),
                           PatchOf({-gap, 0, 0}, {0, 1, 0}, {0, 0, 1})});
}

bool Abut(const std::vector<PatchGeometry>& patches,
          ElementFrame a = {},
          ElementFrame b = {}) {
  const TransferEnd i = MakeTransferEnd(patches[0], a);
  const TransferEnd j = MakeTransferEnd(patches[1], b);
  EXPECT_EQ(AbutAlongEdge(i, j), AbutAlongEdge(j, i));
  return AbutAlongEdge(i, j);
}

TEST(AbutAlongEdge, IsSharingMoreThanAPointOfAnEdge) {
  const auto touching = RightAngle(0);
  EXPECT_TRUE(Abut(touching));
  EXPECT_FALSE(Abut(RightAngle(0.01)));
  // Quarters at the line: first side by side, then one step apart along the
  // line.
  const ElementFrame low{0, 0, 0.5F};
  EXPECT_TRUE(Abut(touching, low, low));
  EXPECT_FALSE(Abut(touching, low, {0.5F, 0, 0.5F}));  // a corner is shared
  EXPECT_FALSE(Abut(touching, {0.5F, 0, 0.5F}, low));  // not at the line
  // A part of an edge.
  EXPECT_TRUE(Abut(touching, {}, {0.25F, 0, 0.125F}));
}

// R keeps means and S makes a constant of a constant. The total that a constant
// source brings is therefore the mean, over the receiver's boxes, of what their
// centers see of the source.
TEST(FlatletTransfer, BringsWhatTheCentersOfBoxesSee) {
  const auto patches = RightAngle(0);
  for (const size_t order : {size_t{1}, size_t{2}, size_t{3}}) {
    const Basis basis(order);
    const HierarchicalTransfer transfer(basis, SingularRule::kFlatlets);
    const Coupling ends = transfer.Couple(
        MakeTransferEnd(patches[0], {}), MakeTransferEnd(patches[1], {}), true);
    const NodeKernel kernel = transfer.InBasis(ends, transfer.Unoccluded(ends));
    double mean = 0;
    for (size_t i = 0; i < kernel.size(); ++i) {
      const size_t g = i / kMaxNodes;
      mean +=
          g < basis.parallelogram.NodeCount()
              ? basis.parallelogram.Weight(g) * static_cast<double>(kernel[i])
              : 0;
    }
    double seen = 0;
    const Corners corners = CornersOf(patches[1], {});
    for (size_t k = 0; k < order; ++k) {
      const float x =
          (static_cast<float>(k) + 0.5F) / static_cast<float>(order);
      for (size_t j = 0; j < order; ++j) {
        const float y =
            (static_cast<float>(j) + 0.5F) / static_cast<float>(order);
        seen += static_cast<double>(
            PointToPolygon({x, y, 0}, patches[0].normal, corners.View()));
      }
    }
    EXPECT_NEAR(mean, seen / static_cast<double>(order * order), kFloatRounding)
        << order;
  }
}

// The two differ by the square of size over distance: for ends of at most 0.1
// that are 10 apart, by 1e-4 of a kernel of at most 0.01 / 314.
TEST(SwitchOverTransfer, IsPlainWhereSourcesAreFar) {
  auto patches = test::RandomPatches(3, 40, 0.1, 0.1);
  for (size_t i = 0; i < patches.size(); i += 2) {
    patches[i].origin = patches[i].origin + Vec3{10, 0, 0};
  }
  const auto geometry = test::GeometryOf(patches);
  for (const BasisKind kind : {BasisKind{1, false}, {2, true}, {3, true}}) {
    const Basis basis(kind);
    const HierarchicalTransfer plain(basis, SingularRule::kNone);
    const HierarchicalTransfer switching(basis, SingularRule::kSwitch);
    for (size_t i = 0; i + 1 < geometry.size(); i += 2) {
      const Coupling ends = plain.Couple(MakeTransferEnd(geometry[i], {}),
                                         MakeTransferEnd(geometry[i + 1], {}),
                                         false);
      const NodeKernel a = plain.Unoccluded(ends);
      const NodeKernel b = switching.Unoccluded(ends);
      for (size_t k = 0; k < a.size(); ++k) {
        EXPECT_NEAR(a[k], b[k], 1e-8);
      }
    }
  }
}

TEST(FormFactorEstimate, IsThatOfPointsWhereEndsAreFar) {
  const auto geometry =
      test::GeometryOf({PatchOf({0, 0, 0}, {0.1, 0, 0}, {0, 0.1, 0}),
                        PatchOf({2, 0, 3}, {0, 0.2, 0}, {0.2, 0, 0})});
  const TransferEnd a = MakeTransferEnd(geometry[0], {});
  const TransferEnd b = MakeTransferEnd(geometry[1], {});
  EXPECT_FLOAT_EQ(FormFactorEstimate(a, b), PointToPoint(a, b));
  EXPECT_FLOAT_EQ(FormFactorEstimate(b, a), PointToPoint(b, a));
}

// The estimate is positive however the ends are turned: their centers may be
// behind each other although their rims are not.
TEST(FormFactorEstimate, IsNowhereZeroWhereLightMayPass) {
  const auto geometry = test::GeometryOf(test::RandomPatches(5, 400, 2, 1));
  for (size_t i = 0; i + 1 < geometry.size(); i += 2) {
    const TransferEnd a = MakeTransferEnd(geometry[i], {});
    const TransferEnd b = MakeTransferEnd(geometry[i + 1], {});
    EXPECT_GT(FormFactorEstimate(a, b), 0);
    EXPECT_LE(FormFactorEstimate(a, b), 1);
  }
}

class Oracles : public ::testing::Test {
 protected:
  // The error of a link with a source of that radiosity everywhere.
  static LinkError Of(OracleKind kind,
                      const Basis& basis,
                      const std::vector<TransferEnd>& ends,
                      float radiosity) {
    const HierarchicalOracle oracle(kind, basis, {1, 2});
    const auto end = [&](const TransferEnd& e) {
      return MakeNodeEnd(basis.On(e.patch->shape), *e.patch, e.frame);
    };
    const NodeEnd receiver = end(ends[0]);
    const NodeEnd source = end(ends[1]);
    const std::vector<float> sent(kRgbChannels * kMaxNodes, radiosity);
    return oracle.Error({receiver, source, sent});
  }

  // Two ends of that size, neither parallel nor face to face.
  static std::vector<PatchGeometry> Ends(double size) {
    return test::GeometryOf(
        {PatchOf({0, 0, 0}, {size, 0, 0}, {0, 1.5 * size, 0}),
         PatchOf({1, 2, 3}, {0.3 * size, size, 0}, {size, 0, -0.5 * size})});
  }
};

// A source that is twice as bright has twice the error, and a dark source has
// none. Only the form-factor oracle ignores brightness.
TEST_F(Oracles, WeighBrightnessButForTheFormFactor) {
  const auto patches = Ends(0.5);
  const std::vector<TransferEnd> ends = {MakeTransferEnd(patches[0], {}),
                                         MakeTransferEnd(patches[1], {})};
  for (const BasisKind kind : {BasisKind{1, false}, {2, false}, {2, true}}) {
    const Basis basis(kind);
    for (const OracleKind oracle :
         {OracleKind::kPower, OracleKind::kPolynomial, OracleKind::kTransfer}) {
      const float error = Of(oracle, basis, ends, 1).error;
      EXPECT_GT(error, 0);
      EXPECT_FLOAT_EQ(Of(oracle, basis, ends, 2).error, 2 * error);
      EXPECT_EQ(Of(oracle, basis, ends, 0).error, 0);
    }
    EXPECT_EQ(Of(OracleKind::kFormFactor, basis, ends, 0).error,
              Of(OracleKind::kFormFactor, basis, ends, 7).error);
  }
}

// A_i F_ij = A_j F_ji.
TEST_F(Oracles, PowerIsTheSameBothWays) {
  const auto patches = Ends(0.5);
  const Basis basis(size_t{1});
  const TransferEnd a = MakeTransferEnd(patches[0], {});
  const TransferEnd b = MakeTransferEnd(patches[1], {0, 0, 0.25F});
  EXPECT_FLOAT_EQ(Of(OracleKind::kPower, basis, {a, b}, 1).error,
                  Of(OracleKind::kPower, basis, {b, a}, 1).error);
  // The end that looks larger to the other is to be split.
  EXPECT_FALSE(Of(OracleKind::kPower, basis, {a, b}, 1).source_is_worse);
  EXPECT_TRUE(Of(OracleKind::kPower, basis, {b, a}, 1).source_is_worse);
}

// At half the size, power falls to 1/16, with both areas, and what a polynomial
// of degree below k leaves of the kernel falls with h^k. The next term of the
// series is h / r = 0.1 of that at first.
TEST_F(Oracles, PolynomialFallsWithTheOrderOfTheBasis) {
  for (const size_t order : {size_t{1}, size_t{2}, size_t{3}}) {
    const Basis basis(order);
    std::array<double, 2> errors{};
    for (size_t i = 0; i < errors.size(); ++i) {
      const auto patches = Ends(i == 0 ? 0.4 : 0.2);
      errors[i] =
          Of(OracleKind::kPolynomial,
             basis,
             {MakeTransferEnd(patches[0], {}), MakeTransferEnd(patches[1], {})},
             1)
              .error;
    }
    EXPECT_NEAR(
        std::log2(errors[0] / errors[1]), 4 + static_cast<double>(order), 0.3)
        << order;
  }
}

TEST(HierarchicalOptions, AreTheStudysWhereNothingIsGiven) {
  const MethodOptions none;
  EXPECT_EQ(HierarchicalOptionsOf(none, "haar").singular,
            SingularRule::kSwitch);
  EXPECT_EQ(HierarchicalOptionsOf(none, "f3").singular, SingularRule::kSwitch);
  EXPECT_EQ(HierarchicalOptionsOf(none, "m3").singular,
            SingularRule::kFlatlets);
  EXPECT_EQ(HierarchicalOptionsOf(none, "m4").singular, SingularRule::kNone);
  EXPECT_EQ(HierarchicalOptionsOf(none, "f2").oracle, OracleKind::kPower);
  EXPECT_EQ(HierarchicalOptionsOf(none, "m2").oracle, OracleKind::kPolynomial);
  EXPECT_EQ(HierarchicalOptionsOf(none, "m2").visibility,
            VisibilityMode::kTriage);
}

TEST(HierarchicalOptions, RefuseWhatHasNoMeaning) {
  MethodOptions method;
  method.singular = "switch";
  EXPECT_THROW((void)HierarchicalOptionsOf(method, "m2"), UsageError);
  EXPECT_NO_THROW((void)HierarchicalOptionsOf(method, "f2"));
  method.singular = "cc";
  EXPECT_THROW((void)HierarchicalOptionsOf(method, "f2"), UsageError);
  EXPECT_THROW((void)HierarchicalOptionsOf(method, "m4"), UsageError);
  EXPECT_NO_THROW((void)HierarchicalOptionsOf(method, "haar"));
  method.singular = "jacobi";
  EXPECT_THROW((void)HierarchicalOptionsOf(method, "m2"), UsageError);
}

}  // namespace
}  // namespace enfilade
