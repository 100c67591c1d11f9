// The shadows of chair legs, which all rays may miss, against paths of light at
// points of the floor around every leg.

#include "base/random.h"
#include "partition/partition.h"
#include "partition/patch.h"
#include "store/sqlite_store.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "tests/budgets.h"
#include "tests/tools/run_program.h"
#include "tools/building_store.h"
#include "tools/verify/paths.h"
#include "tools/verify/verify.h"
#include <gtest/gtest.h>

namespace enfilade {
namespace {

constexpr double kLegM = 0.04;  // wide
constexpr double kBandLegs = 3;
constexpr size_t kPointsPerLeg = 48;
constexpr uint32_t kStrata = 16;  // squared: paths of a point
constexpr size_t kLegs = 64;      // of 16 chairs
// The least contrast, over the mean light of all bands, of a leg with a shadow
// of its own: many legs stand in the shadow of a seat.
constexpr double kLeastContrast = 0.1;
// The least share that the solution has of the contrast by paths, fitted to
// measurements and not derived. In ten solves (M2, five seeds, two versions)
// the faintest shadow had 0.41 to 0.78, 0.53 in the mean with a deviation of
// 0.11; the bound is two deviations below. All others had 0.73 and more.
constexpr double kLeastShare = 0.3;
constexpr double kShareOfMost = 0.65;

// The middles of the feet, by the upright patches that end on the floor and are
// no wider than a leg.
std::vector<Point3> FindLegs(const BuildingView& view) {
  std::vector<Box3> legs;
  for (size_t i = 0; i < view.partition->cells.size(); ++i) {
    for (const Patch& patch : view.load_cell(CellId(i)).patches) {
      Box3 side;
      for (const auto& [a, b] : {std::pair(0, 0), {1, 0}, {0, 1}}) {
        side.Include(PointOn(patch, a, b));
      }
      const Vec3 extent = side.Extent();
      if (side.low.z > 1e-3 || extent.z < 0.1 ||
          std::hypot(extent.x, extent.y) > 1.1 * kLegM) {
        continue;
      }
      side.high.z = side.low.z = 0;
      const auto leg = std::find_if(legs.begin(), legs.end(), [&](Box3 other) {
        return Length(other.Center() - side.Center()) < 2 * kLegM;
      });
      if (leg == legs.end()) {
        legs.push_back(side);
      } else {
        leg->Include(side);
      }
    }
  }
  std::vector<Point3> feet;
  for (const Box3& leg : legs) {
    feet.push_back(leg.Center());
  }
  return feet;
}

// A point of the floor and the light there, by the solution and by two
// independent sets of paths.
struct FloorPoint {
  double solved = 0;
  double first = 0;
  double second = 0;
};

// The excess of the brightest quarter of a leg's points over the darkest. One
// set of paths tells which points these are, the other how bright they are.
struct Contrast {
  double solved = 0;
  double by_paths = 0;
};

Contrast ContrastOf(std::span<FloorPoint> points) {
  std::sort(points.begin(), points.end(), [](const auto& a, const auto& b) {
    return a.first < b.first;
  });
  const size_t quarter = points.size() / 4;
  Contrast contrast;
  for (size_t i = 0; i < quarter; ++i) {
    const FloorPoint& dark = points[i];
    const FloorPoint& bright = points[points.size() - 1 - i];
    const auto share = 1 / static_cast<double>(quarter);
    contrast.solved += share * (bright.solved - dark.solved);
    contrast.by_paths += share * (bright.second - dark.second);
  }
  return contrast;
}

class LegShadows : public ::testing::TestWithParam<std::string> {
 protected:
  void SetUp() override {
    const std::string scene = folder_ / "chairs.obj";
    ASSERT_EQ(RunProgram({"scene", "chairs", "--count", "16", scene}).exit_code,
              0);
    ASSERT_EQ(RunProgram({"solve",
                          scene,
                          "-o",
                          folder_ / "chairs.enf",
                          "--error",
                          "0.05",
                          "--basis",
                          GetParam()})
                  .exit_code,
              0);
    store_ = OpenStore(folder_ / "chairs.enf", StoreAccess::kRead);
  }

  // The points of the bands of all legs, leg by leg.
  std::vector<FloorPoint> PointsAbout(const std::vector<Point3>& legs,
                                      const BuildingView& view,
                                      MemoryBudget& budget) {
    std::vector<Receiver> receivers;
    std::vector<PatchPoint> on_floor;
    Random random(MixKey(7, 1));
    constexpr double kReach = (0.5 + kBandLegs) * kLegM;
    for (const Point3 leg : legs) {
      for (size_t i = 0; i < kPointsPerLeg;) {
        const Point3 at = leg + Vec3{(2 * random.Next() - 1) * kReach,
                                     (2 * random.Next() - 1) * kReach,
                                     0};
        if (Length(at - leg) < kLegM / std::numbers::sqrt2) {
          continue;  // may be under it
        }
        const TraceRay down{at + Vec3{0, 0, 0.01}, {0, 0, -1}};
        TraceHit hit;
        view.trace({&down, 1}, {&hit, 1});
        if (!hit.hit) {
          continue;  // beyond the open side
        }
        on_floor.push_back({hit.cell, hit.patch, hit.a, hit.b});
        receivers.push_back({at, {0, 0, 1}, hit.cell});
        ++i;
      }
    }
    const std::vector<Rgb> solved = view.irradiance(on_floor);
    PathTracer paths(view, budget);
    const auto first =
        paths.Irradiance(receivers, 1, kStrata, GatherMode::kPaths, {});
    const auto second =
        paths.Irradiance(receivers, 2, kStrata, GatherMode::kPaths, {});
    std::vector<FloorPoint> points;
    for (size_t i = 0; i < receivers.size(); ++i) {
      points.push_back({MeanChannel(solved[i]),
                        MeanChannel(first[i]),
                        MeanChannel(second[i])});
    }
    return points;
  }

  TemporaryFolder folder_;
  std::unique_ptr<BlockStorage> store_;
};

TEST_P(LegShadows, AreAllThereAndAsGoodAsTheRest) {
  MemoryBudget budget(kRoomy);
  StoredBuilding building(*store_, budget, Sharing::kShares);
  const std::vector<Point3> legs = FindLegs(building.View());
  ASSERT_EQ(legs.size(), kLegs);
  std::vector<FloorPoint> points =
      PointsAbout(legs, building.View(), building.WorkBudget());
  double square = 0;
  double mean = 0;
  const double n = static_cast<double>(points.size());
  for (const FloorPoint& p : points) {
    EXPECT_GE(p.solved, 0);
    square += (p.solved - p.first) * (p.solved - p.second) / n;
    mean += p.second / n;
  }
  VerifyOptions options;
  options.max_seconds = 8;
  EXPECT_LT(std::sqrt(square) / mean,
            2 * Verify(*store_, options, budget).error);
  size_t weak = 0;
  for (size_t leg = 0; leg < legs.size(); ++leg) {
    const Contrast contrast = ContrastOf(
        std::span(points).subspan(leg * kPointsPerLeg, kPointsPerLeg));
    if (contrast.by_paths > kLeastContrast * mean) {
      EXPECT_GT(contrast.solved, kLeastShare * contrast.by_paths)
          << "leg " << leg;
      weak += contrast.solved < kShareOfMost * contrast.by_paths ? 1 : 0;
    }
  }
  EXPECT_LE(weak, 1U);
}

INSTANTIATE_TEST_SUITE_P(Bases,
                         LegShadows,
                         ::testing::Values("haar", "m2", "m3"));

}  // namespace
}  // namespace enfilade
