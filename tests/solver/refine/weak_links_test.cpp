// Sampled links are right on the average, whatever each single link brings.

#include "base/random.h"
#include "solver/refine/refiner.h"
#include "solver/transfer/source_group.h"

#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include "tests/solver/test_bulbs.h"
#include "tests/solver/test_cells.h"
#include "tests/solver/test_refinement.h"
#include "tests/visibility/test_rooms.h"
#include <gtest/gtest.h>

namespace enfilade {
namespace {

using test::Append;
using test::BrightCell;
using test::Ceiling;
using test::Floor;
using test::GeometryOf;
using test::MeanGain;
using test::RefineAll;
using test::Scenery;
using test::Tiled;

struct Statistics {
  double mean = 0;
  double standard_error = 0;
};

Statistics StatisticsOf(double sum, double square, int count) {
  const double mean = sum / count;
  return {mean, std::sqrt((square / count - mean * mean) / count)};
}

// Of the sum of gain_of(link) over all links, for many seeds of the random
// numbers, which `key` tells from those of other scenes.
template <typename GainOf>
Statistics OverSeeds(int seeds,
                     uint64_t key,
                     const RefineReceiver& receiver,
                     const test::SourceAndTree& source,
                     const Blockers& blockers,
                     const GainOf& gain_of) {
  RefineOptions options;
  options.tau = 1e9;
  options.tau_weak = 1e9;
  double sum = 0;
  double square = 0;
  for (int seed = 0; seed < seeds; ++seed) {
    options.seed = MixKey(key, static_cast<uint64_t>(seed));
    double gain = 0;
    for (const RawLinks& item :
         RefineAll(options, receiver, source, blockers)) {
      for (const RawLink& link : item.links) {
        gain += gain_of(link);
      }
    }
    sum += gain;
    square += gain * gain;
  }
  return StatisticsOf(sum, square, seeds);
}

// The mean gain, over many seeds, of the floor's 4 x 4 tiles from tiles of 1
// W/m2 that are all too weak to be linked outright: the floor's mean form
// factor to them.
Statistics SampledFormFactor(const std::vector<Patch>& sources,
                             const std::vector<Patch>& blockers,
                             int seeds) {
  const Basis basis(2);
  const std::vector<Patch> floor = Tiled(Floor(), 4);
  const BrightCell receiver(0, basis, floor);
  const BrightCell source(1, basis, sources);
  std::vector<Patch> all = floor;
  Append(all, sources);
  Append(all, blockers);
  const Scenery scenery(all);
  return OverSeeds(seeds,
                   77,
                   receiver.Receiver(),
                   source.Source(),
                   scenery.All(),
                   [](const RawLink& link) { return MeanGain(link) / 16; });
}

void ExpectUnbiased(const Statistics& seen, double form_factor) {
  EXPECT_NEAR(seen.mean, form_factor, 3 * seen.standard_error);
  // Enough seeds to see a bias of 1 %.
  EXPECT_LT(3 * seen.standard_error, 0.01 * form_factor);
}

TEST(SlowWeakLinks, AreUnbiasedBetweenParallelSquares) {
  // The closed forms of scenes/parallel.md.
  ExpectUnbiased(SampledFormFactor(Tiled(Ceiling(1), 20), {}, 30000), 0.199825);
  ExpectUnbiased(SampledFormFactor(Tiled(Ceiling(2), 20), {}, 90000), 0.068590);
}

// There are so many tiles that the links of whole clusters of tiles are drawn
// at once.
TEST(SlowWeakLinks, AreUnbiasedFromThousandsOfTiles) {
  ExpectUnbiased(SampledFormFactor(Tiled(Ceiling(1), 64), {}, 30000), 0.199825);
  // Some tiles are too near for that.
  ExpectUnbiased(SampledFormFactor(Tiled(Ceiling(0.1), 64), {}, 5000),
                 0.826995);
}

TEST(SlowWeakLinks, AreUnbiasedCloseUp) {
  ExpectUnbiased(SampledFormFactor(Tiled(Ceiling(0.1), 20), {}, 5000),
                 0.826995);
}

TEST(SlowWeakLinks, AreUnbiasedAroundACorner) {
  // scenes/perpendicular.md; the tiles along the common edge touch.
  const Patch wall = test::Rectangle(Point3{}, {0, 1, 0}, {0, 0, 1});
  ExpectUnbiased(SampledFormFactor(Tiled(wall, 20), {}, 30000), 0.200044);
}

TEST(SlowWeakLinks, AreUnbiasedWhereHalfOfTheirSourcesIsHidden) {
  // A plate a third of a millimetre below half of the ceiling; what passes
  // through that gap is less than its height over the plate's width.
  Patch plate = Ceiling(1 - 3e-4);
  plate.v = {0.5, 0, 0};
  const Statistics seen =
      SampledFormFactor(Tiled(Ceiling(1), 20), {plate}, 50000);
  ExpectUnbiased(seen, 0.199825 / 2);
}

// A ball that hangs straight above a small floor and counts as one source.
class BulbAboveFloor {
 public:
  // `floor`: m, its edge. `plate_under`: hides what is beyond x = 0.
  BulbAboveFloor(double floor, double height, bool plate_under)
      : bulb_(test::Bulb({0, 0, height}, kRadius, 5)) {
    const std::vector<Patch> tiles =
        Tiled(test::Rectangle(
                  {-floor / 2, -floor / 2, 0}, {floor, 0, 0}, {0, floor, 0}),
              4);
    receiver_.emplace(0, basis_, tiles);
    std::vector<Patch> lit = bulb_;
    // Patches count as lamps only if little of a cell emits.
    lit.push_back(test::Rectangle({-1, -1, 3}, {0, 2, 0}, {2, 0, 0}));
    source_.emplace(1, basis_, lit);
    for (float& b : source_->Tree().Sent()[ElementId(lit.size() - 1)]) {
      b = 0;
    }
    groups_.emplace(source_->Geometry());
    std::vector<Patch> all = tiles;
    Append(all, lit);
    if (plate_under) {
      const double z = height - kRadius - 0.01;
      all.push_back(test::Rectangle({0, -1, z}, {1, 0, 0}, {0, 2, 0}));
    }
    scenery_.emplace(all);
  }

  // The form factor from the middle of the floor to the ball's facets.
  [[nodiscard]] double Exact() const {
    double exact = 0;
    for (const Patch& p : bulb_) {
      const std::vector<PatchGeometry> facet = GeometryOf({p});
      const Corners corners = CornersOf(facet[0], {});
      if (Dot(Vec3f{0, 0, 0} - facet[0].origin, facet[0].normal) > 0) {
        exact += static_cast<double>(
            PointToPolygon({0, 0, 0}, {0, 0, 1}, corners.View()));
      }
    }
    return exact;
  }

  // The mean gain of the floor's tiles, over all seeds.
  [[nodiscard]] Statistics Gains(int seeds) const {
    return OverSeeds(
        seeds,
        78,
        receiver_->Receiver(),
        source_->Source(&*groups_),
        scenery_->All(),
        [](const RawLink& link) {
          return link.kind == LinkKind::kGroup ? MeanGain(link) / 16 : 0;
        });
  }

 private:
  static constexpr double kRadius = 0.05;

  const Basis basis_ = Basis(2);
  std::vector<Patch> bulb_;
  std::optional<BrightCell> receiver_;
  std::optional<BrightCell> source_;
  std::optional<SourceGroups> groups_;
  std::optional<Scenery> scenery_;
};

// The floor is so small that form factors differ over it by a thousandth.
TEST(SlowWeakLinks, OfABulbAsOneAreUnbiased) {
  const BulbAboveFloor lit(0.004, 0.15, false);
  const Statistics seen = lit.Gains(200000);
  EXPECT_NEAR(seen.mean, lit.Exact(), 4 * seen.standard_error);
  EXPECT_LT(4 * seen.standard_error, 0.01 * lit.Exact());
}

// The visible facets cover half of (r / d)^2.
TEST(SlowWeakLinks, OfABulbAsOneAreUnbiasedWhereHalfOfItIsHidden) {
  const BulbAboveFloor lit(0.02, 1, true);
  const Statistics seen = lit.Gains(200000);
  EXPECT_NEAR(seen.mean, 0.5 * lit.Exact(), 4 * seen.standard_error);
  EXPECT_LT(4 * seen.standard_error, 0.1 * lit.Exact());
}

TEST(WeakLinks, StoreTheirGainToHalfPrecision) {
  const Basis basis(2);
  const BrightCell receiver(0, basis, Tiled(Floor(), 4));
  const BrightCell source(1, basis, Tiled(Ceiling(0.5), 20));
  const Scenery scenery({});
  RefineOptions options;
  options.tau = 1e9;
  options.tau_weak = 1e9;
  size_t links = 0;
  for (const RawLinks& item : RefineAll(
           options, receiver.Receiver(), source.Source(), scenery.All())) {
    for (const RawLink& link : item.links) {
      EXPECT_EQ(link.kind, LinkKind::kWeak);
      EXPECT_NEAR(
          static_cast<double>(DecodeCoefficient(link.value)) / MeanGain(link),
          1,
          std::ldexp(1, -11));
      ++links;
    }
  }
  EXPECT_GT(links, 0U);
}

TEST(WeakLinks, BringNothingFromBehind) {
  const Basis basis(2);
  const BrightCell receiver(0, basis, Tiled(Floor(), 4));
  const Patch towards = Ceiling(1);
  Patch away = towards;
  std::swap(away.u, away.v);  // faces up
  const Scenery scenery({});
  const auto links_from = [&](const Patch& patch) {
    const BrightCell source(1, basis, Tiled(patch, 20));
    RefineOptions options;
    options.tau_weak = 0.01;
    options.tau = 0.02;
    size_t links = 0;
    for (uint64_t seed = 0; seed < 100; ++seed) {
      options.seed = seed;
      for (const RawLinks& item : RefineAll(
               options, receiver.Receiver(), source.Source(), scenery.All())) {
        links += item.links.size();
      }
    }
    return links;
  };
  EXPECT_GT(links_from(towards), 100U);
  EXPECT_EQ(links_from(away), 0U);
}

}  // namespace
}  // namespace enfilade
