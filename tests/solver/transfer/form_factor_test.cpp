// Form factors against closed forms and against each other.

#include "solver/transfer/form_factor.h"

#include "base/random.h"
#include "solver/transfer/arc_tangent.h"

#include <array>
#include <cmath>
#include <span>

#include <gtest/gtest.h>

namespace enfilade {
namespace {

PatchGeometry MakeRectangle(Point3 origin, Vec3 u, Vec3 v) {
  Patch patch;
  patch.origin = origin;
  patch.u = u;
  patch.v = v;
  return MakePatchGeometry(patch, Material{}, Point3{});
}

// Mean over a grid of midpoints of the receiver of the exact point form factor.
double MeanFormFactor(const PatchGeometry& receiver,
                      const PatchGeometry& source,
                      size_t grid) {
  const Corners corners = CornersOf(source, {});
  double sum = 0;
  for (size_t i = 0; i < grid; ++i) {
    for (size_t j = 0; j < grid; ++j) {
      const float n = static_cast<float>(grid);
      const Vec3f x = PointOn(receiver,
                              {},
                              (static_cast<float>(i) + 0.5F) / n,
                              (static_cast<float>(j) + 0.5F) / n);
      sum += static_cast<double>(
          PointToPolygon(x, receiver.normal, corners.View()));
    }
  }
  return sum / static_cast<double>(grid * grid);
}

// The polynomial is off by 2.7e-14, and each of some ten operations by 1.1e-16.
TEST(AngleOf, IsTheArcTangentToTheStatedError) {
  const double least = std::ldexp(1.0, -40);
  for (double slope = least; slope < 1 / least; slope *= 1.0007) {
    for (const double x : {1.0, -1.0}) {
      const double exact = std::atan2(slope, x);
      ASSERT_NEAR(AngleOf(slope, x), exact, 1e-13 * exact) << slope;
      ASSERT_NEAR(AngleOf(slope * 1e-9, x * 1e-9), exact, 1e-13 * exact);
    }
  }
  EXPECT_EQ(AngleOf(0, 0), 0);
  EXPECT_EQ(AngleOf(0, 2), 0);
  EXPECT_DOUBLE_EQ(AngleOf(0, -2), kPi);
  EXPECT_DOUBLE_EQ(AngleOf(3, 0), kPi / 2);
}

TEST(PointToPolygon, IsTheWholeHemisphereForAnEndlessCeiling) {
  const PatchGeometry ceiling =
      MakeRectangle({-1e4, 1e4, 1}, {2e4, 0, 0}, {0, -2e4, 0});
  const Corners corners = CornersOf(ceiling, {});
  EXPECT_NEAR(PointToPolygon({0, 0, 0}, {0, 0, 1}, corners.View()), 1.0, 1e-3);
}

TEST(PointToPolygon, ClipsWhatIsBelowTheHorizon) {
  // Only the upper half of a wall through the horizon counts; a wall that
  // starts at the horizon counts the same.
  const PatchGeometry whole = MakeRectangle({1, -1, -2}, {0, 2, 0}, {0, 0, 4});
  const PatchGeometry upper = MakeRectangle({1, -1, 0}, {0, 2, 0}, {0, 0, 2});
  const Vec3f up = {0, 0, 1};
  const Corners of_upper = CornersOf(upper, {});
  const Corners of_whole = CornersOf(whole, {});
  const float f = PointToPolygon({}, up, of_upper.View());
  EXPECT_GT(f, 0.1F);
  EXPECT_NEAR(PointToPolygon({}, up, of_whole.View()), f, 1e-6);
}

TEST(PointToPolygon, ParallelUnitSquaresMatchTheClosedForm) {
  const PatchGeometry floor = MakeRectangle({0, 0, 0}, {1, 0, 0}, {0, 1, 0});
  const PatchGeometry top = MakeRectangle({0, 1, 1}, {1, 0, 0}, {0, -1, 0});
  // Midpoint rule with n^2 points: error of order 1/n^2, here below 1e-5.
  EXPECT_NEAR(MeanFormFactor(floor, top, 64), 0.199825, 2e-5);
}

TEST(PointToPolygon, SquaresAtARightAngleMatchTheClosedForm) {
  const PatchGeometry floor = MakeRectangle({0, 0, 0}, {1, 0, 0}, {0, 1, 0});
  const PatchGeometry wall = MakeRectangle({0, 0, 0}, {0, 1, 0}, {0, 0, 1});
  // The singular edge slows the midpoint rule down to about 1/n.
  EXPECT_NEAR(MeanFormFactor(floor, wall, 256), 0.200044, 2e-4);
}

TEST(PointToPolygon, FacesOfABoxAddUpToOne) {
  Random random(7);
  for (int trial = 0; trial < 200; ++trial) {
    const Vec3f x = {static_cast<float>(0.05 + 0.9 * random.Next()),
                     static_cast<float>(0.05 + 0.9 * random.Next()),
                     static_cast<float>(0.05 + 0.9 * random.Next())};
    const double z = 2 * random.Next() - 1;
    const double phi = 2 * kPi * random.Next();
    const double r = std::sqrt(1 - z * z);
    const Vec3f n = {static_cast<float>(r * std::cos(phi)),
                     static_cast<float>(r * std::sin(phi)),
                     static_cast<float>(z)};
    const std::array<PatchGeometry, 6> faces = {
        MakeRectangle({0, 0, 0}, {1, 0, 0}, {0, 1, 0}),
        MakeRectangle({0, 0, 1}, {1, 0, 0}, {0, 1, 0}),
        MakeRectangle({0, 0, 0}, {1, 0, 0}, {0, 0, 1}),
        MakeRectangle({0, 1, 0}, {1, 0, 0}, {0, 0, 1}),
        MakeRectangle({0, 0, 0}, {0, 1, 0}, {0, 0, 1}),
        MakeRectangle({1, 0, 0}, {0, 1, 0}, {0, 0, 1})};
    double sum = 0;
    for (const PatchGeometry& face : faces) {
      const Corners corners = CornersOf(face, {});
      sum += static_cast<double>(PointToPolygon(x, n, corners.View()));
    }
    EXPECT_NEAR(sum, 1.0, 1e-5);
  }
}

// Lambert's formula edge by edge, of a polygon above the horizon.
double Lambert(Vec3f x, Vec3f n, std::span<const Vec3f> polygon) {
  const auto relative = [&](Vec3f p) {
    return Vec3{static_cast<double>(p.x) - static_cast<double>(x.x),
                static_cast<double>(p.y) - static_cast<double>(x.y),
                static_cast<double>(p.z) - static_cast<double>(x.z)};
  };
  double sum = 0;
  for (size_t i = 0; i < polygon.size(); ++i) {
    const Vec3 a = relative(polygon[i]);
    const Vec3 b = relative(polygon[(i + 1) % polygon.size()]);
    const Vec3 cross = Cross(a, b);
    sum += std::atan2(Length(cross), Dot(a, b)) * Dot({n.x, n.y, n.z}, cross) /
           Length(cross);
  }
  return std::abs(sum) / (2 * kPi);
}

// A relative error of 1e-13 in the angles of four edges makes at most 4 pi
// 1e-13 / (2 pi); the result is rounded to float, by half of 2^-23 at most.
TEST(PointToPolygon, IsLambertsFormulaToTheRoundingOfItsResult) {
  Random random(11);
  const auto next = [&] { return 2 * random.Next() - 1; };
  double largest = 0;
  for (int trial = 0; trial < 5000; ++trial) {
    const double size = std::exp2(6 * next());
    PatchGeometry patch =
        MakeRectangle({next(), next(), size + 1.5 + next()},
                      {size * next(), size * next(), size * next() / 2},
                      {size * next(), size * next(), size * next() / 2});
    patch.shape =
        trial % 2 == 0 ? PatchShape::kParallelogram : PatchShape::kTriangle;
    const Corners corners = CornersOf(patch, {});
    const double expected = Lambert({}, {0, 0, 1}, corners.View());
    largest = std::max(largest, expected);
    ASSERT_NEAR(PointToPolygon({}, {0, 0, 1}, corners.View()),
                expected,
                3e-13 + std::ldexp(expected, -23))
        << trial;
  }
  EXPECT_GT(largest, 0.2);
}

TEST(Kernel, QuadratureConvergesToTheExactFormFactorWithDistance) {
  const PatchGeometry floor = MakeRectangle({0, 0, 0}, {1, 0, 0}, {0, 1, 0});
  double last = 1;
  for (const double height : {2.0, 4.0, 8.0}) {
    const PatchGeometry top =
        MakeRectangle({0.3, 1.2, height}, {1, 0, 0}, {0, -1, 0});
    const TransferEnd r = MakeTransferEnd(floor, {});
    const TransferEnd s = MakeTransferEnd(top, {});
    const Kernel plain = QuadratureKernel(r, s);
    const Kernel exact = NearKernel(r, s);
    double worst = 0;
    for (size_t g = 0; g < kTransferNodes; ++g) {
      double a = 0;
      double b = 0;
      for (size_t q = 0; q < kTransferNodes; ++q) {
        a += static_cast<double>(plain[g * kTransferNodes + q]);
        b += static_cast<double>(exact[g * kTransferNodes + q]);
      }
      worst = std::max(worst, std::abs(a / b - 1));
    }
    // The error is of fourth order in diameter over distance, 16 times less at
    // twice the distance; the factor 10 leaves room for the next order.
    EXPECT_LT(worst, height == 2.0 ? 0.01 : last / 10) << height;
    last = worst;
  }
}

TEST(Kernel, TriangleNodesCarryAllTheWeight) {
  Patch patch;
  patch.u = {1, 0, 0};
  patch.v = {0, 2, 0};
  patch.shape = PatchShape::kTriangle;
  const PatchGeometry g = MakePatchGeometry(patch, Material{}, Point3{});
  const TransferEnd end = MakeTransferEnd(g, {});
  EXPECT_EQ(end.node_count, 3U);
  EXPECT_EQ(end.nodes.weight[3], 0.0F);
  EXPECT_FLOAT_EQ(end.area, 1.0F);
  EXPECT_FLOAT_EQ(
      end.nodes.weight[0] + end.nodes.weight[1] + end.nodes.weight[2], 1.0F);
}

}  // namespace
}  // namespace enfilade
