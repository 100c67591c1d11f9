#include "tools/verify/guide.h"

#include "base/random.h"

#include <cmath>
#include <utility>
#include <vector>

#include "tests/budgets.h"
#include "tests/tools/verify_fake_building.h"
#include "tools/verify/paths.h"
#include <gtest/gtest.h>

namespace enfilade {
namespace {

constexpr uint64_t kGuideBytes = 8 << 20;
// The light on the floor, about; W/m2.
constexpr double kMeanRadiosity = 0.05;

// A dim room, in which a lamp shines at the wall behind it: nearly all light
// comes from a bright spot of that wall.
class SpotRoom {
 public:
  SpotRoom() {
    const MaterialId grey = building_.AddMaterial({.6, .6, .6}, {});
    const MaterialId lamp = building_.AddMaterial({}, {1000, 1000, 1000});
    const MaterialId black = building_.AddMaterial({}, {});
    building_.AddRoom({4, 4, 3}, grey);
    building_.Add({3.8, 1.95, 1.45}, {0, .1, 0}, {0, 0, .1}, lamp);
    building_.Add({3.79, 1.95, 1.45}, {0, 0, .1}, {0, .1, 0}, black);
  }

  [[nodiscard]] const BuildingView& View() const { return building_.View(); }

  // One part for each of 16 squares of a tenth of a metre, with a share of the
  // lamp's 10 W.
  static std::vector<BrightPart> Parts() {
    std::vector<BrightPart> parts;
    for (int i = 0; i < 16; ++i) {
      const double y = 1.8 + .1 * (i % 4 + .5);
      const double z = 1.3 + .1 * (i / 4 + .5);
      parts.push_back({{4, y, z}, .08, .25, CellId(0U)});
    }
    return parts;
  }

 private:
  FakeBuilding building_;
};

PathGuide LearnedGuide(const SpotRoom& room, MemoryBudget& budget) {
  PathGuide guide;
  guide.Learn(
      room.View(), SpotRoom::Parts(), kMeanRadiosity, budget, kGuideBytes, 7);
  return guide;
}

// The vertices lie on the floor, on the ceiling, and on the wall of the spot,
// whose horizon cuts the spot's spheres.
const std::pair<Point3, Vec3> kVertices[] = {
    {{.7, 1.1, 0}, {0, 0, 1}},
    {{2, 2, 3}, {0, 0, -1}},
    {{4, 1, 1.5}, {-1, 0, 0}},
};

// The density's integral over the hemisphere is 1. Directions are uniform in
// height and azimuth. The density is constant except on the rims of the cones,
// which few of 10^6 cells meet: each of at most 16 rims, of some 0.05 of a
// radian, less than 1 % of the cells inside.
TEST(PathGuideTest, TheDensityIsOne) {
  const SpotRoom room;
  MemoryBudget budget(kModest);
  const PathGuide guide = LearnedGuide(room, budget);
  double most_share = 0;
  for (const auto& [x, normal] : kVertices) {
    const PathGuide::Aims aims = guide.At(CellId(0U), x, normal);
    most_share = std::max(most_share, aims.Share());
    constexpr int kSide = 1000;
    double mean = 0;
    for (int i = 0; i < kSide * kSide; ++i) {
      const double height = (i / kSide + .5) / kSide;
      const Vec3 w = CosineDirection(
          normal, 1 - height * height, (i % kSide + .5) / kSide);
      mean += 2 * height * aims.Excess(w) / kSide / kSide;
    }
    EXPECT_NEAR(mean, 1, .01);
  }
  EXPECT_GT(most_share, .2) << "nothing was guided";
}

// Directions have the density that they are divided by: weighted means of
// functions of directions are those of the cosine distribution, whose second
// moments of the components are 1/4, 1/4 and 1/2. The test takes the component
// towards the spot, where the density is not the cosine's.
TEST(PathGuideTest, DirectionsHaveTheirDensity) {
  const SpotRoom room;
  MemoryBudget budget(kModest);
  const PathGuide guide = LearnedGuide(room, budget);
  for (const auto& [x, normal] : kVertices) {
    const PathGuide::Aims aims = guide.At(CellId(0U), x, normal);
    const Vec3 to_spot = Normalize(Point3{4, 2, 1.5} - x);
    const double cosine = Dot(to_spot, normal);
    Random random(5);
    constexpr int kCount = 200000;
    double sum = 0;
    double squares = 0;
    for (int i = 0; i < kCount; ++i) {
      const double u = random.Next();
      const Vec3 w = aims.Direction(u, random.Next());
      EXPECT_NEAR(Length(w), 1, 1e-9);
      EXPECT_GE(Dot(w, normal), 0);
      const double along = Dot(w, to_spot);
      const double value = along * along / aims.Excess(w);
      sum += value / kCount;
      squares += value * value / kCount;
    }
    EXPECT_NEAR(sum,
                (1 + cosine * cosine) / 4,
                5 * std::sqrt((squares - sum * sum) / kCount));
  }
}

TEST(PathGuideTest, WithoutBrightPartsTheCosineRules) {
  const SpotRoom room;
  MemoryBudget budget(kModest);
  PathGuide guide;
  EXPECT_EQ(
      guide.Learn(room.View(), {}, kMeanRadiosity, budget, kGuideBytes, 7), 0U);
  const auto& [x, normal] = kVertices[0];
  const PathGuide::Aims aims = guide.At(CellId(0U), x, normal);
  EXPECT_EQ(aims.Share(), 0);
  EXPECT_EQ(Length(aims.Direction(.3, .8) - CosineDirection(normal, .3, .8)),
            0);
  EXPECT_EQ(aims.Excess(normal), 1);
}

TEST(PathGuideTest, WithoutMemoryNothingIsGuided) {
  const SpotRoom room;
  MemoryBudget budget(kModest);
  PathGuide guide;
  EXPECT_EQ(
      guide.Learn(
          room.View(), SpotRoom::Parts(), kMeanRadiosity, budget, 1000, 7),
      0U);
  const auto& [x, normal] = kVertices[0];
  EXPECT_EQ(guide.At(CellId(0U), x, normal).Share(), 0);
}

// The same light with and without the guide, and less noise with it. Five
// standard errors of the difference: one false alarm in 10^6.
TEST(PathGuideTest, LearningKeepsTheMeanAndLowersTheNoise) {
  const SpotRoom room;
  MemoryBudget budget(kModest);
  PathTracer plain(room.View(), budget);
  PathTracer guided(room.View(), budget);
  guided.LearnBrightParts(SpotRoom::Parts(), kMeanRadiosity, budget, 7);
  constexpr int kCount = 1024;
  const auto& [x, normal] = kVertices[0];
  const std::vector<Receiver> receivers(kCount, {x, normal, CellId(0U)});
  double means[2];
  double variances[2];
  for (int k = 0; k < 2; ++k) {
    PathTracer& tracer = k == 0 ? plain : guided;
    double sum = 0;
    double squares = 0;
    for (const Rgb& h :
         tracer.Irradiance(receivers, 5, 4, GatherMode::kPaths, {})) {
      sum += h[0] / kCount;
      squares += h[0] * h[0] / kCount;
    }
    means[k] = sum;
    variances[k] = squares - sum * sum;
  }
  EXPECT_NEAR(means[0],
              means[1],
              5 * std::sqrt((variances[0] + variances[1]) / kCount));
  EXPECT_LT(variances[1], .25 * variances[0]);
}

}  // namespace
}  // namespace enfilade
