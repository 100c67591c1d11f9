// Sampled transfers: right on the average, and their rays carry light.

#include "solver/transfer/transfer_sample.h"

#include "solver/transfer/cosine_directions.h"

#include <cmath>
#include <functional>

#include "tests/solver/test_cells.h"
#include "tests/visibility/test_rooms.h"
#include <gtest/gtest.h>

namespace enfilade {
namespace {

using test::GeometryOf;
using test::RandomPatches;
using test::RandomPointOn;
using test::Rectangle;

// Two patches as the ends of a transfer.
class Ends {
 public:
  explicit Ends(const std::vector<Patch>& patches)
      : geometry_(GeometryOf(patches)) {}

  [[nodiscard]] TransferEnd Receiver() const { return End(0); }

  [[nodiscard]] TransferEnd Source() const { return End(1); }

 private:
  [[nodiscard]] TransferEnd End(size_t i) const {
    return MakeTransferEnd(geometry_[i], {});
  }

  std::vector<PatchGeometry> geometry_;
};

struct Moments {
  double mean = 0;
  double deviation = 0;  // of one value
  double standard_error = 0;
};

Moments Measure(size_t count, const std::function<double()>& next) {
  double sum = 0;
  double square = 0;
  for (size_t i = 0; i < count; ++i) {
    const double value = next();
    sum += value;
    square += value * value;
  }
  const double n = static_cast<double>(count);
  const double variance = square / n - sum * sum / (n * n);
  return {sum / n, std::sqrt(variance), std::sqrt(variance / n)};
}

const Patch kFloor = Rectangle({0, 0, 0}, {1, 0, 0}, {0, 1, 0});

Patch Wall() {
  return Rectangle({0, 0, 0}, {0, 1, 0}, {0, 0, 1});
}

Patch CeilingAt(double height) {
  return Rectangle({0, 0, height}, {0, 1, 0}, {1, 0, 0});
}

void ExpectMean(const std::vector<Patch>& patches,
                bool near,
                double form_factor) {
  const Ends ends(patches);
  Random random(11);
  const Moments seen = Measure(20000, [&] {
    return static_cast<double>(
        SampleTransfer(ends.Receiver(), ends.Source(), near, &random)
            .form_factor);
  });
  // Points keep a thousandth off the rim, where factors differ by at most 1.
  EXPECT_NEAR(seen.mean, form_factor, 4 * seen.standard_error + 4e-3);
}

TEST(SampledTransfer, IsRightOnTheAverage) {
  // The closed forms of scenes/parallel.md and scenes/perpendicular.md.
  ExpectMean({kFloor, CeilingAt(1)}, true, 0.199825);
  ExpectMean({kFloor, CeilingAt(1)}, false, 0.199825);
  ExpectMean({kFloor, CeilingAt(0.1)}, true, 0.826995);
  ExpectMean({kFloor, Wall()}, true, 0.200044);
}

TEST(IndexAtShare, NeverTakesAWeightOfZero) {
  const std::vector<float> weights = {0, 1, 0, 3, 0};
  EXPECT_EQ(IndexAtShare(weights, 0), 1U);
  EXPECT_EQ(IndexAtShare(weights, 0.24F), 1U);
  EXPECT_EQ(IndexAtShare(weights, 0.26F), 3U);
  EXPECT_EQ(IndexAtShare(weights, 1), 3U);
}

// The ends are a tile of a thousandth of the floor's area and the floor, and
// either receives.
TEST(SampledTransfer, TakesPointsOfTheSmallerEnd) {
  const double side = std::sqrt(1e-3);
  const Patch tile = Rectangle({0.5, 0.5, 0.1}, {0, side, 0}, {side, 0, 0});
  for (const bool tile_receives : {false, true}) {
    const Ends ends(tile_receives ? std::vector<Patch>{tile, kFloor}
                                  : std::vector<Patch>{kFloor, tile});
    Random random(5);
    const Moments seen = Measure(2000, [&] {
      return static_cast<double>(
          SampleTransfer(ends.Receiver(), ends.Source(), true, &random)
              .form_factor);
    });
    EXPECT_LT(seen.deviation, 0.02 * seen.mean);
  }
}

// Half of the light of a point at height h over a floor lands within h of the
// point's foot: rho^2 / (rho^2 + h^2).
TEST(PairAtPeak, IsDrawnByTheKernel) {
  constexpr float kHeight = 0.05F;
  const Patch speck =
      Rectangle({0.3, 0.6, kHeight}, {0, 1e-3, 0}, {1e-3, 0, 0});
  for (const bool speck_receives : {false, true}) {
    const Ends ends(speck_receives ? std::vector<Patch>{speck, kFloor}
                                   : std::vector<Patch>{kFloor, speck});
    const TransferEnd r = ends.Receiver();
    const TransferEnd s = ends.Source();
    EXPECT_TRUE(IsPeaked(
        1e-3F, speck_receives ? r.center : s.center, speck_receives ? s : r));
    Random random(3);
    int pairs = 0;
    int inner = 0;
    for (int i = 0; i < 4000; ++i) {
      if (const auto pair = PairAtPeak(r, s, &random)) {
        ++pairs;
        EXPECT_GT(PointKernel(*pair, r, s), 0);
        const Vec3f d = pair->x - pair->y;
        inner += std::hypot(d.x, d.y) < kHeight ? 1 : 0;
      }
    }
    // Less than h^2 / (h^2 + 0.3^2) = 3 % of the draws lie beyond the floor's
    // edges and are repeated.
    EXPECT_EQ(pairs, 4000);
    EXPECT_NEAR(
        inner, 0.5 * pairs, 0.015 * pairs + 4 * std::sqrt(0.25 * pairs));
  }
}

TEST(PairAtPeak, LooksAtWhatIsCloseAndSmall) {
  const Ends ends({kFloor, CeilingAt(1)});
  const TransferEnd floor = ends.Receiver();
  EXPECT_FALSE(IsPeaked(0.01F, {0.5F, 0.5F, 0.8F}, floor)) << "far";
  EXPECT_FALSE(IsPeaked(0.8F, {0.5F, 0.5F, 0.1F}, floor)) << "large";
  Random random(3);
  // The back of a ceiling that faces up.
  const Ends away({kFloor, Rectangle({0, 0, 1}, {1, 0, 0}, {0, 1, 0})});
  EXPECT_FALSE(PairAtPeak(away.Receiver(), away.Source(), &random));
}

TEST(SampledTransfer, VariesAtMostHalfAsMuchAsOnePoint) {
  const Ends ends({kFloor, Wall()});
  const TransferEnd r = ends.Receiver();
  const Corners wall = CornersOf(*ends.Source().patch, {});
  Random random(7);
  const Moments one = Measure(20000, [&] {
    return static_cast<double>(PointToPolygon(
        RandomPointOn(*r.patch, {}, random), r.patch->normal, wall.View()));
  });
  const Moments all = Measure(20000, [&] {
    return static_cast<double>(
        SampleTransfer(r, ends.Source(), true, &random).form_factor);
  });
  EXPECT_LT(all.deviation, 0.5 * one.deviation);
}

// Ends may cut through each other's planes: a ray that starts or ends behind
// one of them would find light that never arrives.
TEST(SampledTransfer, ItsRayGoesFromFrontToFront) {
  int rays = 0;
  for (uint64_t seed = 1; seed <= 3000; ++seed) {
    const Ends ends(RandomPatches(seed, 2, 0.8, 1.5));
    const TransferEnd r = ends.Receiver();
    const TransferEnd s = ends.Source();
    Random random(seed);
    for (const bool near : {false, true}) {
      const SampledTransfer sample = SampleTransfer(r, s, near, &random);
      if (sample.form_factor > 0) {
        EXPECT_GT(PointKernel(sample.ray, r, s), 0) << seed;
        ++rays;
      }
    }
  }
  EXPECT_GT(rays, 1000);
}

// Most of one end may lie behind the other; rays from there would pass below
// the surface that they start from.
TEST(RandomPair, GoesFromFrontToFront) {
  int asked = 0;
  int missed = 0;
  for (uint64_t seed = 1; seed <= 3000; ++seed) {
    const Ends ends(RandomPatches(seed, 2, 0.8, 1.5));
    const TransferEnd r = ends.Receiver();
    const TransferEnd s = ends.Source();
    Random random(seed);
    const auto node = [](const TransferEnd& end, size_t i) {
      return end.nodes.At(i);
    };
    for (size_t g = 0; g < r.node_count; ++g) {
      for (size_t q = 0; q < s.node_count; ++q) {
        const auto pair = RandomPair(r, g, s, q, &random);
        if (pair) {
          EXPECT_GT(PointKernel(*pair, r, s), 0) << seed;
        }
        if (PointKernel({node(r, g), node(s, q)}, r, s) > 0) {
          ++asked;
          missed += pair ? 0 : 1;
        }
      }
    }
  }
  EXPECT_GT(asked, 5000);
  EXPECT_LT(missed, 0.002 * asked);
}

// Two tiles of one oblique plane, far from the origin: rounding puts the
// corners of one a little above and below the plane of the other, in any order.
TEST(RandomPair, LiesOnItsEndsWhereRoundingDecidesWhatIsInFront) {
  const auto is_on = [](const TransferEnd& end, Vec3f p) {
    return Length(p - end.center) < end.diameter;
  };
  for (uint64_t seed = 1; seed <= 20000; ++seed) {
    Random random(seed);
    const auto next = [&] { return 2 * random.Next() - 1; };
    const Vec3 u = Normalize(Vec3{next(), next(), next()}) * 0.3;
    const Vec3 v = Normalize(Cross(u, Vec3{next(), next(), next()})) * 0.3;
    const Point3 origin{300 * next(), 300 * next(), 300 * next()};
    const Ends ends({Rectangle(origin, u, v), Rectangle(origin + u, u, v)});
    const TransferEnd r = ends.Receiver();
    const TransferEnd s = ends.Source();
    if (const auto pair = RandomPair(r, 0, s, 0, &random)) {
      ASSERT_TRUE(is_on(r, pair->x)) << seed;
      ASSERT_TRUE(is_on(s, pair->y)) << seed;
    }
  }
}

// No ray starts at the rim, so that a surface that touches an edge opens no
// crack.
TEST(RandomPoint, KeepsOffTheRim) {
  Random random(3);
  for (const Patch& patch : RandomPatches(9, 40, 1, 1)) {
    const auto geometry = GeometryOf({patch});
    const TransferEnd end = MakeTransferEnd(geometry[0], {});
    const Corners corners = CornersOf(geometry[0], {});
    const auto view = corners.View();
    for (int k = 0; k < 200; ++k) {
      const Vec3f p = RandomPoint(end, &random);
      for (size_t i = 0; i < view.size(); ++i) {
        const Vec3f edge = view[(i + 1) % view.size()] - view[i];
        const float off = Length(Cross(edge, p - view[i])) / Length(edge);
        EXPECT_GT(off, 4e-4F);
      }
    }
  }
}

// The tolerance is the remainder of Taylor's series, (pi / 4)^13 / 13!.
TEST(OnCircle, IsTheSineAndTheCosine) {
  for (int i = 0; i <= 100000; ++i) {
    const double t = i / 100000.0;
    const CirclePoint at = OnCircle(t);
    ASSERT_NEAR(at.cosine, std::cos(2 * kPi * t), 1e-11) << t;
    ASSERT_NEAR(at.sine, std::sin(2 * kPi * t), 1e-11) << t;
  }
}

// The mean of a cosine-distributed direction is 2/3 of the normal, and each
// coordinate across it has the variance 1/4. Five standard errors.
TEST(CosineDirections, HaveTheMomentsOfTheirDistribution) {
  const std::vector<PatchGeometry> geometry = GeometryOf({Wall()});
  const CosineDirections directions(geometry[0]);
  const Vec3f n = geometry[0].normal;
  Random random(5);
  constexpr int kCount = 100000;
  double mean = 0;
  double square = 0;
  for (int i = 0; i < kCount; ++i) {
    const Vec3f d = directions.Draw(&random);
    ASSERT_NEAR(Length(d), 1, 1e-6);
    const float across = Dot(d, geometry[0].u);
    mean += Dot(d, n) / kCount;
    square += across * across / kCount;
  }
  // The variance of the cosine is 1/18, of the square 1/8 - 1/16 = 1/16.
  EXPECT_NEAR(mean, 2.0 / 3, 5 * std::sqrt(1.0 / 18 / kCount));
  EXPECT_NEAR(square, 0.25, 5 * std::sqrt(1.0 / 16 / kCount));
}

// Candidates that are drawn side by side have the bits of pairs drawn one by
// one.
TEST(PairCandidates, AreThePairsThatAreDrawnOneByOne) {
  for (uint64_t trial = 0; trial < 200; ++trial) {
    const std::vector<PatchGeometry> geometry =
        GeometryOf(RandomPatches(trial, 2, 3, 1));
    const TransferEnd r = MakeTransferEnd(geometry[0], {0.25F, 0.5F, 0.25F});
    const TransferEnd s = MakeTransferEnd(geometry[1], {});
    const size_t g = trial % r.node_count;
    const size_t q = trial % s.node_count;
    Random together(trial);
    Random one_by_one(trial);
    const PairCandidates pairs = DrawCandidates(r, g, s, q, &together);
    for (size_t i = 0; i < kCandidates; ++i) {
      const Vec3f x = PointNearNode(r, g, &one_by_one);
      const Vec3f y = PointNearNode(s, q, &one_by_one);
      const PointPair pair = pairs.At(i);
      EXPECT_EQ(Length(pair.x - x), 0);
      EXPECT_EQ(Length(pair.y - y), 0);
      EXPECT_EQ(pairs.kernels[i], PointKernel({x, y}, r, s));
    }
    EXPECT_EQ(together.NextBits(), one_by_one.NextBits());
  }
}

}  // namespace
}  // namespace enfilade
