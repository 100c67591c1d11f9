// Items of work: cells that hardly see each other have next to none, and the
// light that such cells get from each other is right on the average.

#include "solver/refine/pair_work.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "tests/solver/test_bulbs.h"
#include "tests/solver/test_cells.h"
#include "tests/solver/test_refinement.h"
#include "tests/visibility/test_rooms.h"
#include <gtest/gtest.h>

namespace enfilade {
namespace {

using test::BrightCell;
using test::Ceiling;
using test::Floor;
using test::MeanGain;
using test::RefineAll;
using test::Scenery;
using test::Tiled;

constexpr double kPi = 3.14159265358979323846;

// The form factor between unit squares that face each other at a distance
// (Howell, A Catalog of Radiation Heat Transfer Configuration Factors, C-11).
double BetweenUnitSquares(double distance) {
  const double x = 1 / distance;
  const double q = 1 + x * x;
  return 2 / (kPi * x * x) *
         (std::log(std::sqrt(q * q / (1 + 2 * x * x))) +
          2 * x * std::sqrt(q) * std::atan(x / std::sqrt(q)) -
          2 * x * std::atan(x));
}

struct Average {
  double sum = 0;
  double squares = 0;
  int count = 0;

  void Add(double value) {
    sum += value;
    squares += value * value;
    ++count;
  }

  [[nodiscard]] double Mean() const { return sum / count; }

  [[nodiscard]] double StandardError() const {
    return std::sqrt((squares / count - Mean() * Mean()) / count);
  }
};

// The mean gain of the receiver's patches, one value per seed.
Average GainsOf(const RefineReceiver& receiver,
                const test::SourceAndTree& source,
                const Blockers& blockers) {
  Average average;
  for (uint64_t seed = 0; seed < 10000; ++seed) {
    double sum = 0;
    for (const RawLinks& item :
         RefineAll({.seed = seed}, receiver, source, blockers)) {
      for (const RawLink& link : item.links) {
        sum += MeanGain(link);
      }
    }
    average.Add(sum / static_cast<double>(receiver.patches.size()));
  }
  return average;
}

TEST(PairWork, AreNextToNoneBetweenCellsThatHardlySeeEachOther) {
  const Basis basis(2);
  const Scenery scenery({});
  const BrightCell floor(0, basis, Tiled(Floor(), 32));
  const BrightCell near(1, basis, Tiled(Ceiling(0.5), 32));
  const BrightCell far(1, basis, Tiled(Ceiling(1000), 32));
  const auto items = [&](const BrightCell& ceiling) {
    return PairWork({}, floor.Receiver(), ceiling.Source()).Items().size();
  };
  EXPECT_GE(items(near), 1024U / 8);
  EXPECT_LE(items(far), 1U);
}

Vec3f MiddleOf(const PatchGeometry& p) {
  return p.origin + (p.u + p.v) * 0.5F;
}

// The visible parts end just before, or just behind, the edges of patches.
TEST(PairWork, LinksWhatSeesEachOtherAlone) {
  const RefineOptions options = {.tau = 0.01, .tau_weak = 1e-9};
  const Basis basis(2);
  const Scenery scenery({});
  const BrightCell floor(0, basis, Tiled(Floor(), 4));
  const BrightCell ceiling(1, basis, Tiled(Ceiling(0.7), 4));
  RefineReceiver receiver = floor.Receiver();
  test::SourceAndTree source = ceiling.Source();
  std::vector<RawLink> expected;
  for (const RawLinks& item :
       RefineAll(options, receiver, source, scenery.All())) {
    for (const RawLink& link : item.links) {
      if (MiddleOf(floor.Geometry()[link.receiver_patch]).x < 0.5F &&
          MiddleOf(ceiling.Geometry()[link.source_patch]).y > 0.5F) {
        expected.push_back(test::WithoutPlace(link));
      }
    }
  }
  ASSERT_GE(expected.size(), 64U) << "each of 8 patches from each of 8";
  receiver.part.high.x = 0.499F;
  source.part.low.y = 0.501F;
  size_t count = 0;
  for (const RawLinks& item :
       RefineAll(options, receiver, source, scenery.All())) {
    for (const RawLink& link : item.links) {
      ASSERT_LT(count, expected.size());
      test::ExpectSame(test::WithoutPlace(link), expected[count]);
      ++count;
    }
  }
  EXPECT_EQ(count, expected.size());
}

TEST(PairWork, IsNoneWhereNothingOfACellCanBeSeen) {
  const Basis basis(2);
  const BrightCell floor(0, basis, Tiled(Floor(), 4));
  const BrightCell ceiling(1, basis, Tiled(Ceiling(0.7), 4));
  test::SourceAndTree source = ceiling.Source();
  source.part.high.z = 0.6F;
  EXPECT_FALSE(
      PairWork({}, floor.Receiver(), ceiling.Source()).Items().empty());
  EXPECT_TRUE(PairWork({}, floor.Receiver(), source).Items().empty());
}

// Refinement looks at two or three of a million pairs.
TEST(PairWork, OfFarCellsAreRightOnTheAverage) {
  const Basis basis(2);
  const Scenery scenery({});
  const BrightCell floor(0, basis, Tiled(Floor(), 32));
  const BrightCell ceiling(1, basis, Tiled(Ceiling(10), 32));
  const Average gains =
      GainsOf(floor.Receiver(), ceiling.Source(), scenery.All());
  const double exact = BetweenUnitSquares(10);
  EXPECT_LE(gains.StandardError(), 0.05 * exact);
  EXPECT_NEAR(gains.Mean(), exact, 4 * gains.StandardError());
}

// A bulb, which counts as one source, hangs far above a floor.
TEST(PairWork, OfAFarBulbAreRightOnTheAverage) {
  constexpr double kHeight = 6;
  constexpr double kRadius = 0.05;
  const Basis basis(2);
  const Scenery scenery({});
  const BrightCell floor(0, basis, Tiled(Floor(), 32));
  // The bulb hangs below a shelf that faces away.
  std::vector<Patch> patches = {
      test::Rectangle({0, 0, kHeight + 1}, {1, 0, 0}, {0, 1, 0})};
  test::Append(patches, test::Bulb({0.5, 0.5, kHeight}, kRadius, 5));
  const BrightCell lamp(1, basis, patches);
  const SourceGroups groups(lamp.Geometry());
  const test::SourceAndTree source = lamp.Source(&groups);
  ASSERT_EQ(groups.Roots().size(), 1U);
  // A convex body shows a quarter of its area on the average over all
  // directions; a bulb shows nearly as much from each direction.
  const double area = static_cast<double>(groups.All()[groups.Roots()[0]].area);
  const double about = area / 4 / (kPi * kHeight * kHeight);
  const Average gains = GainsOf(floor.Receiver(), source, scenery.All());
  EXPECT_LE(gains.StandardError(), 0.05 * about);
  EXPECT_NEAR(gains.Mean(), about, 4 * gains.StandardError() + 0.02 * about);
}

}  // namespace
}  // namespace enfilade
