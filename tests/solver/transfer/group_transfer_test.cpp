// Transfers from groups: form factors against closed forms, rays against
// shadows that are known.

#include "solver/transfer/group_transfer.h"

#include <array>
#include <cmath>
#include <memory>
#include <vector>

#include "tests/solver/test_bulbs.h"
#include "tests/solver/test_cells.h"
#include "tests/visibility/test_rooms.h"
#include <gtest/gtest.h>

namespace enfilade {
namespace {

using test::Append;
using test::Bulb;
using test::GeometryOf;
using test::Rectangle;

constexpr double kBulbRadius = 0.1;
constexpr double kBulbHeight = 1;

// A small square floor below a bulb, and what stands between.
class Scene {
 public:
  explicit Scene(double floor_side,
                 const std::vector<Patch>& blockers = {},
                 double height = kBulbHeight)
      : patches_{Rectangle({-0.5 * floor_side, -0.5 * floor_side, 0},
                           {floor_side, 0, 0},
                           {0, floor_side, 0})} {
    // Bulbs count as lamps only if little of a cell emits.
    patches_.push_back(Rectangle({-5, -5, 9}, {0, 9, 0}, {9, 0, 0}));
    Append(patches_, Bulb({0, 0, height}, kBulbRadius, 6));
    Append(patches_, blockers);
    geometry_ = GeometryOf(patches_);
    groups_ = SourceGroups(geometry_);
    receiver_ = MakeTransferEnd(geometry_[0], {});
    CellPatches cell;
    cell.bounds = {{-9, -9, -9}, {9, 9, 9}};
    cell.patches = patches_;
    ray_blockers_ = device_.Build(cell);
    shafts_ = std::make_unique<ShaftBlockers>(geometry_);
    all_.rays = {ray_blockers_.get()};
    all_.shafts = {shafts_.get()};
  }

  [[nodiscard]] const SourceGroup& Group() const {
    return groups_.All()[groups_.Roots()[0]];
  }

  [[nodiscard]] GroupTransfer Transfer() const {
    GroupTransfer transfer(
        receiver_, geometry_, groups_, Group(), WholeGroup(Group()));
    transfer.Evaluate();
    return transfer;
  }

  GroupSight Look(uint64_t seed) {
    const GroupTransfer transfer = Transfer();
    return GroupRays(all_, receiver_, transfer, seed, &rays_).Look(8, 8);
  }

  bool SeesPeak(uint64_t seed) {
    const GroupTransfer transfer = Transfer();
    return GroupRays(all_, receiver_, transfer, seed, &rays_).SeesPeak();
  }

  [[nodiscard]] uint64_t RaysTraced() const { return rays_.traced; }

  [[nodiscard]] bool IsProvenClear() const {
    return Transfer().IsProvenClear(all_);
  }

 private:
  std::vector<Patch> patches_;
  std::vector<PatchGeometry> geometry_;
  SourceGroups groups_;
  TransferEnd receiver_;
  MemoryBudget budget_{1ULL << 30};
  OcclusionDevice device_{budget_, Point3{}};
  std::shared_ptr<const RayBlockers> ray_blockers_;
  std::unique_ptr<ShaftBlockers> shafts_;
  Blockers all_;
  RayCount rays_;
};

// A ball at distance d straight ahead covers (r / d)^2 of a hemisphere; the
// body inscribed in it lies between that and the ball through the middles of
// its facets, cos^2 (pi / 12) smaller.
TEST(GroupTransfer, OfABallIsTheSquareOfItsSine) {
  const Scene scene(1e-3);
  const double ball = kBulbRadius * kBulbRadius / (kBulbHeight * kBulbHeight);
  const double facets = std::pow(std::cos(kPi / 12), 2);
  const GroupTransfer transfer = scene.Transfer();
  const auto seen = static_cast<double>(transfer.FormFactor());
  EXPECT_LT(seen, ball);
  EXPECT_GT(seen, ball * facets * facets);
  EXPECT_GE(transfer.FormFactorBound(), transfer.FormFactor());
  // Facets that look up send nothing to the floor below.
  EXPECT_LT(transfer.Facing().count, scene.Group().count * 3 / 5);
}

// Samples at single random points have the mean over the floor.
TEST(GroupTransfer, SamplesAreRightOnTheAverage) {
  const Scene scene(1);
  const GroupTransfer transfer = scene.Transfer();
  Random random(5);
  double sum = 0;
  double square = 0;
  constexpr int kSamples = 4000;
  for (int i = 0; i < kSamples; ++i) {
    const auto f = static_cast<double>(transfer.Sample(&random).form_factor);
    sum += f;
    square += f * f;
  }
  const double mean = sum / kSamples;
  const double error = std::sqrt((square / kSamples - mean * mean) / kSamples);
  // The mean over points on a fine grid of the floor, since cos^4 falls off.
  double exact = 0;
  constexpr int kGrid = 40;
  for (int i = 0; i < kGrid; ++i) {
    for (int k = 0; k < kGrid; ++k) {
      std::array<float, kMostGroupPatches> unused{};
      const auto x = static_cast<float>((i + 0.5) / kGrid - 0.5);
      const auto y = static_cast<float>((k + 0.5) / kGrid - 0.5);
      exact += static_cast<double>(transfer.FormFactorsOf({x, y, 0}, &unused));
    }
  }
  exact /= kGrid * kGrid;
  EXPECT_NEAR(mean, exact, 4 * error);
  EXPECT_LT(error, 0.01 * exact);
}

TEST(GroupTransfer, IsRougherOnLargerReceivers) {
  const Basis haar(1);
  const Basis linear(2);
  const auto residual = [](double side, const Basis& basis) {
    const Scene scene(side);
    const GroupTransfer transfer = scene.Transfer();
    return transfer.Residual(basis) / transfer.FormFactor();
  };
  EXPECT_LT(residual(0.5, haar), 0.5F * residual(1, haar));
  // The residual is of second order: half the side leaves a quarter of it.
  EXPECT_LT(residual(0.5, linear), 0.3F * residual(1, linear));
  EXPECT_LT(residual(0.5, linear), residual(0.5, haar));
}

TEST(GroupRays, SeeAllWhereNothingStands) {
  Scene scene(0.5);
  const GroupSight sight = scene.Look(1);
  EXPECT_EQ(sight.fraction, 1);
  EXPECT_EQ(sight.points, 4 * GroupRays::kMostPoints);
  EXPECT_TRUE(sight.Agrees());
  EXPECT_EQ(sight.by_receiver, 0);
  EXPECT_EQ(sight.by_source, 0);
  EXPECT_TRUE(scene.IsProvenClear());
}

TEST(GroupRays, SeeNothingBehindAPlate) {
  Scene scene(0.5, {Rectangle({-1, -1, 0.5}, {2, 0, 0}, {0, 2, 0})});
  const GroupSight sight = scene.Look(1);
  EXPECT_EQ(sight.fraction, 0);
  EXPECT_TRUE(sight.Agrees());
  EXPECT_FALSE(scene.IsProvenClear());
}

// A floor inside the bulb sees only the backs of the facets: no ray says that
// any facet is hidden.
TEST(GroupRays, KnowNothingOfWhatFacesAway) {
  Scene scene(0.01, {}, 0);
  const GroupSight sight = scene.Look(1);
  EXPECT_EQ(sight.points, 0U);
  EXPECT_EQ(sight.fraction, 1);
}

// A shade around the bulb hides it from all of the floor but the spot below.
// Random points of the floor miss the spot, which is a thousandth of the floor.
TEST(GroupRays, SeeWhereTheLightPeaks) {
  constexpr double kLow = 0.12;
  const Vec3 up = {0, 0, 0.22};
  const auto shade = [&](double bottom) {
    return std::vector<Patch>{
        Rectangle({-kLow, -kLow, bottom}, {2 * kLow, 0, 0}, up),
        Rectangle({-kLow, kLow, bottom}, {2 * kLow, 0, 0}, up),
        Rectangle({-kLow, -kLow, bottom}, {0, 2 * kLow, 0}, up),
        Rectangle({kLow, -kLow, bottom}, {0, 2 * kLow, 0}, up)};
  };
  Scene open(8, shade(0.01), kLow);
  EXPECT_LT(open.Look(1).fraction, 0.05F);
  EXPECT_TRUE(open.SeesPeak(1));
  std::vector<Patch> closed = shade(0.01);
  closed.push_back(
      Rectangle({-kLow, -kLow, 0.01}, {2 * kLow, 0, 0}, {0, 2 * kLow, 0}));
  EXPECT_FALSE(Scene(8, closed, kLow).SeesPeak(1));
}

TEST(GroupRays, LookForNoPeakFarAway) {
  Scene scene(1, {}, 1);
  EXPECT_FALSE(scene.SeesPeak(1));
  EXPECT_EQ(scene.RaysTraced(), 0U);
}

// A plate close below half of the bulb hides that half from all of the floor.
TEST(GroupRays, KnowAShadowOfTheGroup) {
  Scene scene(0.05,
              {Rectangle({0, -1, kBulbHeight - 0.11}, {1, 0, 0}, {0, 2, 0})});
  const GroupSight sight = scene.Look(1);
  EXPECT_NEAR(sight.fraction, 0.5, 0.1);
  EXPECT_GT(sight.by_source, 10 * sight.by_receiver);
  EXPECT_FALSE(scene.IsProvenClear());
}

// A plate close above half of the floor hides the whole bulb from that half.
TEST(GroupRays, KnowAShadowOnTheReceiver) {
  Scene scene(1, {Rectangle({0, -1, 0.002}, {1, 0, 0}, {0, 2, 0})});
  const GroupSight sight = scene.Look(1);
  EXPECT_NEAR(sight.fraction, 0.5, 0.1);
  EXPECT_GT(sight.by_receiver, 10 * sight.by_source);
  // Nodes 0 and 2 lie at u < 1/2.
  EXPECT_GT(sight.at_nodes[0], 0.9F);
  EXPECT_LT(sight.at_nodes[1], 0.1F);
}

// Averaged over many looks, the fraction is the share of the area that is seen.
TEST(GroupRays, AreUnbiased) {
  Scene scene(0.05,
              {Rectangle({0, -1, kBulbHeight - 0.11}, {1, 0, 0}, {0, 2, 0})});
  double sum = 0;
  double square = 0;
  constexpr int kLooks = 300;
  for (int i = 0; i < kLooks; ++i) {
    const auto seen =
        static_cast<double>(scene.Look(static_cast<uint64_t>(i)).fraction);
    sum += seen;
    square += seen * seen;
  }
  const double mean = sum / kLooks;
  const double error = std::sqrt((square / kLooks - mean * mean) / kLooks);
  // The plate's edge lies in the plane of symmetry, a little below the bulb.
  // Floor points off the middle look past the edge by a fortieth of their
  // distance from the middle, equally on both sides.
  EXPECT_NEAR(mean, 0.5, 4 * error);
  EXPECT_LT(4 * error, 0.01);
}

}  // namespace
}  // namespace enfilade
