#include "tools/verify/points.h"

#include "base/random.h"

#include <cmath>
#include <functional>
#include <span>
#include <vector>

#include "tests/tools/verify_fake_building.h"
#include "tools/verify/density.h"
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

// Takes parts of parts, down to a random depth: all places of a part's stretch
// lie on the part, and the stretch is as long as the part is large.
TEST(StretchOnPatchTest, HoldsThePlacesOfAPart) {
  Random random(2);
  for (const PatchShape shape :
       {PatchShape::kParallelogram, PatchShape::kTriangle}) {
    const bool triangle = shape == PatchShape::kTriangle;
    for (int i = 0; i < 200; ++i) {
      ElementFrame frame;
      const uint32_t levels = random.NextBelow(10);
      for (uint32_t level = 0; level < levels; ++level) {
        frame = ChildOf(frame, shape, random.NextBelow(4));
      }
      const LineStretch stretch = StretchOnPatch(shape, frame);
      EXPECT_EQ(stretch.end - stretch.begin, std::pow(0.25, levels));
      for (int k = 0; k < 8; ++k) {
        const PatchPoint p = PlaceOnPatch(
            shape,
            stretch.begin + random.Next() * (stretch.end - stretch.begin));
        const double s = (p.a - static_cast<double>(frame.a)) /
                         static_cast<double>(frame.scale);
        const double t = (p.b - static_cast<double>(frame.b)) /
                         static_cast<double>(frame.scale);
        EXPECT_GE(s, -1e-4);
        EXPECT_GE(t, -1e-4);
        EXPECT_LE(triangle ? s + t : std::max(s, t), 1 + 1e-4);
      }
    }
  }
}

// A wall of level 1 (in units of the squared radiosity) with a spot a thousand
// times as bright in each of its corners.
class SpottedWall {
 public:
  SpottedWall() : view_(building_.View()) {
    const MaterialId grey = building_.AddMaterial({.5, .5, .5}, {});
    building_.Add({0, 0, 0}, {4, 0, 0}, {0, 4, 0}, grey);
    view_.for_each_mean = [](CellId,
                             std::span<const PatchId>,
                             const std::function<void(const LeafMean&)>& add) {
      AddLeaves({}, 3, add);
    };
  }

  [[nodiscard]] const BuildingView& View() const { return view_; }

  // The integral of the level over all leaves.
  static constexpr double kIntegral = 16 * (1 - 4.0 / 64) + 1e6 * 16 * 4 / 64;

 private:
  static void AddLeaves(ElementFrame frame,
                        int levels,
                        const std::function<void(const LeafMean&)>& add) {
    for (size_t child = 0; child < 4; ++child) {
      const ElementFrame part =
          ChildOf(frame, PatchShape::kParallelogram, child);
      if (levels > 1) {
        AddLeaves(part, levels - 1, add);
        continue;
      }
      const bool corner =
          (part.a < .1F || part.a > .8F) && (part.b < .1F || part.b > .8F);
      const double h = corner ? 2000 : 2;  // times 0.5
      add({PatchId(0U), part, 0, {h, h, h}});
    }
  }

  FakeBuilding building_;
  BuildingView view_;
};

// Whichever leaves have bins of their own or share one, the bins cover the line
// once, and the integral of the level is that of the leaves.
TEST(LightBinsTest, BinsKeepTheIntegralOfTheLevel) {
  const SpottedWall wall;
  const SidePoints sides(wall.View());
  for (const uint32_t parts : {5U, 64U, 1000U}) {
    double at = 0;
    double integral = 0;
    int bright = 0;
    for (const LightBin& bin : FindLightBins(wall.View(), sides, parts, 64)) {
      EXPECT_NEAR(bin.begin, at, 1e-12);
      at = bin.end;
      integral += bin.level * (bin.end - bin.begin);
      bright += bin.level > 1000 ? 1 : 0;
    }
    EXPECT_NEAR(at, 16, 1e-9);
    EXPECT_NEAR(
        integral, SpottedWall::kIntegral, 1e-6 * SpottedWall::kIntegral);
    EXPECT_EQ(bright, 4);
  }
}

TEST(LightBinsTest, OverlaidBinsCoverTheLineOnce) {
  const std::vector<LightBin> bins = {{0, 1, 1}, {1, 2, 2}, {2, 3, 3}};
  const std::vector<LightBin> bright = {
      {0, 0.1, 50}, {0.5, 0.6, 60}, {0.9, 2.2, 70}, {2.9, 3, 80}};
  double line = 0;
  std::vector<double> levels;
  for (const LightBin& bin : Overlaid(bins, bright)) {
    EXPECT_EQ(bin.begin, line);
    EXPECT_GT(bin.end, bin.begin);
    line = bin.end;
    levels.push_back(bin.level);
  }
  EXPECT_EQ(line, 3);
  EXPECT_EQ(levels, (std::vector<double>{50, 1, 60, 1, 70, 3, 80}));
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
  std::vector<LightBin> bins;
  for (int i = 0; i < 64; ++i) {
    const double end = 10 * std::pow((i + 1) / 64.0, 1.5);
    bins.push_back({bins.empty() ? 0 : bins.back().end,
                    end,
                    i < 20 ? 0 : std::pow(1.3, i % 30)});
  }
  PointDensity density(bins);
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
    std::vector<PilotValue> values;
    for (const double place : draw.places) {
      values.push_back({place > 6 && place < 7 ? 100 : .1, .01 * place});
    }
    density.Learn(draw, values);
  }
}

// With noise of variance s^2 per path, and squared differences whose squares
// have the mean V, the best number of paths is s^2 / sqrt(V): many where it is
// bright and noisy, and the fewest elsewhere, which is nearly all of the area.
TEST(PointDensityTest, PathsGoWhereTheNoiseIs) {
  PointDensity density({{0, 9.9, .01}, {9.9, 10, 100}});
  enfilade::Random random(1);
  const auto normal = [&] {
    return std::sqrt(-2 * std::log(1 - random.Next())) *
           std::cos(2 * kPi * random.Next());
  };
  constexpr double kPaths = 16;  // of a density that has learned nothing
  const auto noise2 = [](double place) { return place < 9.9 ? .1 : 24.0; };
  EXPECT_NEAR(density.MeanPaths(), kPaths, 1e-9);
  const PointDensity::Draw draw = density.Choose(200'000, 1);
  std::vector<PilotValue> values;
  for (const double place : draw.places) {
    const double d = random.Next() < .5 ? .3 : .5;
    const double scale = std::sqrt(noise2(place) / kPaths);
    const double a = scale * normal();
    const double b = scale * normal();
    values.push_back({(a - d) * (b - d), (a - b) * (a - b) / 2});
  }
  density.Learn(draw, values);
  // The mean square without noise holds the cross term 2 d^2 s^2 / k and is
  // known to 5 %: the product of two variances, of two numbers each, has 8
  // times the variance of their mean.
  const double square = (.3 * .3 * .3 * .3 + .5 * .5 * .5 * .5) / 2;
  const double between = square + 2 * .17 * noise2(9.95) / kPaths;
  const double root = std::sqrt(noise2(9.95) / std::sqrt(between));
  const PointDensity::Draw next = density.Choose(1000, 2);
  for (size_t i = 0; i < next.places.size(); ++i) {
    if (next.places[i] < 9.9) {
      EXPECT_EQ(next.strata[i], 4U);
    } else {
      EXPECT_NEAR(next.strata[i], root + .5, .5 + .05 * root);
    }
  }
  const double most = .9 * density.MeanPaths();
  density.LimitPaths(most);
  EXPECT_LE(density.MeanPaths(), most);
  EXPECT_GT(density.MeanPaths(), 1.1 * kPaths);
  density.LimitPaths(1);
  EXPECT_NEAR(density.MeanPaths(), kPaths, 1e-9) << "the least";
}

}  // namespace
}  // namespace enfilade
