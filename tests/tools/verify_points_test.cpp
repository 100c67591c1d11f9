#include "tools/verify_points.h"

#include "base/random.h"

#include <cmath>

#include "tests/tools/verify_fake_building.h"
#include "tools/verify_density.h"
#include <gtest/gtest.h>

namespace enfilade {
namespace {

// The integral of a^2 b over the unit square is 1/6 and over the triangle 1/60.
// One place at random in each of 4^7 quarters of quarters: within one, a^2 b
// varies by less than 3 times its size 2^-7, so that the standard error of the
// mean is below 3 * 2^-7 / sqrt(12) / 2^7 = 5.3e-5.
TEST(PlaceOnPatchTest, EqualFractionsGetEqualAreas) {
  constexpr int kPlaces = 1 << 14;
  for (const PatchShape shape :
       {PatchShape::kParallelogram, PatchShape::kTriangle}) {
    const bool triangle = shape == PatchShape::kTriangle;
    double mean = 0;
    enfilade::Random random(1);
    for (int i = 0; i < kPlaces; ++i) {
      const PatchPoint p = PlaceOnPatch(shape, (i + random.Next()) / kPlaces);
      EXPECT_GE(p.a, 0);
      EXPECT_GE(p.b, 0);
      EXPECT_LE(triangle ? p.a + p.b : std::max(p.a, p.b), 1);
      mean += p.a * p.a * p.b / kPlaces;
    }
    // The mean over the triangle is twice the integral.
    EXPECT_NEAR(mean, triangle ? 2.0 / 60 : 1.0 / 6, 5 * 5.3e-5);
  }
}

TEST(SidePointsTest, PlacesFollowTheAreasOfReflectingSides) {
  FakeBuilding building;
  const MaterialId grey = building.AddMaterial({.5, .5, .5}, {});
  const MaterialId black = building.AddMaterial({}, {});
  building.Add({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, grey);
  building.Add({0, 0, 1}, {5, 0, 0}, {0, 1, 0}, black);
  building.AddCell();
  building.Add({0, 0, 2}, {2, 0, 0}, {0, 2, 0}, grey, PatchShape::kTriangle);
  const SidePoints sides(building.View());
  EXPECT_DOUBLE_EQ(sides.Area(), 3);
  const std::vector<double> places{0, .25, .999, 1.001, 1.5, 2.9999999999};
  const std::vector<SidePoint> points = sides.At(places);
  ASSERT_EQ(points.size(), places.size());
  for (size_t i = 0; i < points.size(); ++i) {
    EXPECT_EQ(points[i].receiver.position.z, places[i] < 1 ? 0 : 2);
    EXPECT_EQ(points[i].receiver.cell, CellId(places[i] < 1 ? 0U : 1U));
  }
}

// Whatever the density has learned, weighted means are means over the area.
TEST(PointDensityTest, WeightedMeansAreUnbiased) {
  std::vector<double> levels;
  for (int i = 0; i < 64; ++i) {
    levels.push_back(i < 20 ? 0 : std::pow(1.3, i % 30));
  }
  PointDensity density(10, levels);
  const auto f = [](double place) { return place < 4 ? 1 : 5 + place; };
  constexpr double kMean = (4 + 6 * (5 + 7)) / 10.0;
  for (uint64_t pass = 0; pass < 3; ++pass) {
    double mean = 0;
    double total = 0;
    constexpr int kRounds = 200;
    for (uint64_t round = 0; round < kRounds; ++round) {
      const PointDensity::Draw draw = density.Choose(64, MixKey(pass, round));
      for (size_t i = 0; i < draw.places.size(); ++i) {
        EXPECT_GE(draw.places[i], i > 0 ? draw.places[i - 1] : 0);
        EXPECT_LT(draw.places[i], 10);
        mean += draw.weights[i] * f(draw.places[i]) / (64 * kRounds);
        total += draw.weights[i] / (64 * kRounds);
      }
    }
    // 12,800 stratified points; weights are below 7 and f below 15.
    EXPECT_NEAR(mean, kMean, .1);
    EXPECT_NEAR(total, 1, .01);
    const PointDensity::Draw draw = density.Choose(256, pass);
    std::vector<double> values;
    for (const double place : draw.places) {
      values.push_back(place > 6 && place < 7 ? 100 : .1);
    }
    density.Learn(draw, values);
  }
}

}  // namespace
}  // namespace enfilade
