// Refinement: fine links add up to a hemisphere.

#include "solver/refine/refiner.h"

#include "base/random.h"
#include "solver/links/gather.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <map>
#include <memory>
#include <numeric>
#include <tuple>
#include <utility>

#include "tests/solver/test_bulbs.h"
#include "tests/solver/test_cells.h"
#include "tests/solver/test_refinement.h"
#include "tests/visibility/test_rooms.h"
#include <gtest/gtest.h>

namespace enfilade {
namespace {

using test::Append;
using test::BoxPatches;
using test::BrightCell;
using test::Ceiling;
using test::ExpectSame;
using test::Floor;
using test::FurnishedRoom;
using test::GeometryOf;
using test::kReflectance;
using test::kRoom;
using test::MeanGain;
using test::RefineAll;
using test::RefinedPart;
using test::RefineInParts;
using test::Scenery;
using test::Tiled;
using test::WithoutPlace;

// -------------------------------------------------------------- fine links

// The mean over a patch of what its points gain.
double MeanGainOf(BrightCell& cell, uint32_t patch) {
  double mean = 0;
  for (size_t i = 0; i < cell.Tree().Size(); ++i) {
    const Element& e = cell.Tree().At(ElementId(i));
    if (e.patch == patch) {
      const auto gain = cell.Received().gain[ElementId(i)];
      const double sum = std::accumulate(gain.begin(), gain.end(), 0.0);
      mean += sum / static_cast<double>(gain.size()) *
              static_cast<double>(e.frame.scale * e.frame.scale);
    }
  }
  return mean;
}

struct Gains {
  std::vector<double> means;  // over each patch, of the gain of its points
  double squared_error = 0;   // as refinement predicts it, (W/m)^2
};

// Links a cell to itself.
Gains LinkToItself(const RefineOptions& options,
                   BrightCell* cell,
                   const Blockers& blockers) {
  Gains gains;
  LinkBlock block;
  for (const RawLinks& item :
       RefineAll(options, cell->Receiver(), cell->Source(), blockers)) {
    gains.squared_error += item.squared_error;
    cell->Link(item, &block);
  }
  for (uint32_t i = 0; i < cell->Geometry().size(); ++i) {
    gains.means.push_back(MeanGainOf(*cell, i));
  }
  return gains;
}

class FineLinks : public ::testing::TestWithParam<size_t> {};

TEST_P(FineLinks, OfEachWallOfABareRoomSeeAWholeHemisphere) {
  const Basis basis(GetParam());
  const std::vector<Patch> room = BoxPatches(kRoom, true);
  const Scenery scenery(room);
  for (const double tau : {0.1, 0.02, 0.005, 0.002}) {
    BrightCell cell(0, basis, room);
    RefineOptions options;
    options.tau = tau;
    options.tau_weak = 0.5 * tau;
    const Gains gains = LinkToItself(options, &cell, scenery.All());
    for (size_t i = 0; i < room.size(); ++i) {
      // The prediction is the squared error of rho times the irradiance,
      // integrated over all walls; the mean of a wall can be off by no more
      // than its root. For rooms with equal walls to come out flat, the error
      // must be within 1 %.
      const double predicted =
          std::sqrt(gains.squared_error / PatchArea(room[i])) / kReflectance;
      EXPECT_NEAR(gains.means[i], 1, std::min(predicted, 0.01))
          << "tau " << tau;
    }
  }
}

// A bulb hangs over a floor, with a plate that hides a part of it: the floor
// gains from the bulb as one source what the facets bring one by one.
TEST_P(FineLinks, OfABulbAsOneAreThoseOfItsFacets) {
  const Basis basis(GetParam());
  std::vector<Patch> patches = {
      test::Rectangle({-2, -2, 0}, {4, 0, 0}, {0, 4, 0}),
      test::Rectangle({-0.2, -0.5, 1}, {0, 1, 0}, {1, 0, 0})};
  Append(patches, test::Bulb({0, 0, 2}, 0.05, 5));
  const Scenery scenery(patches);
  RefineOptions options;
  options.tau = 3e-6;
  options.tau_weak = 0.5 * options.tau;
  const auto link = [&](bool as_one) {
    BrightCell cell(0, basis, patches);
    const SourceGroups groups(cell.Geometry());
    const test::SourceAndTree source = cell.Source(as_one ? &groups : nullptr);
    LinkBlock block;
    double squared_error = 0;
    for (const RawLinks& item :
         RefineAll(options, cell.Receiver(), source, scenery.All())) {
      squared_error += item.squared_error;
      cell.Link(item, &block);
    }
    EXPECT_EQ(block.group.empty(), !as_one);
    return std::pair(MeanGainOf(cell, 0), std::sqrt(squared_error));
  };
  const auto [apart, apart_error] = link(false);
  const auto [as_one, as_one_error] = link(true);
  // The errors are those of rho times the irradiance, integrated over the
  // floor's 16 m2.
  const double floor = kReflectance * std::sqrt(16.0);
  EXPECT_GT(apart, 0);
  EXPECT_NEAR(as_one, apart, (apart_error + as_one_error) / floor);
  EXPECT_NEAR(as_one, apart, 0.01 * apart);
}

// A bulb is half sunk into a floor: light is brightest at its rim and ends
// there. An element that the rim crosses is half dark, whatever its nodes
// happen to see, and must be so small that this does not matter. Rays from
// points that have nothing of the bulb before them do not prove that the bulb
// is hidden.
TEST_P(FineLinks, EndAtTheRimOfABulbInTheFloor) {
  constexpr double kRadius = 0.05;
  constexpr double kTau = 2e-4;
  constexpr int kPlaces = 60;
  const Basis basis(GetParam());
  Random random(4711);
  size_t crossed = 0;
  for (int place = 0; place < kPlaces; ++place) {
    const Point3 center{random.Next() - 0.5, random.Next() - 0.5, 0};
    std::vector<Patch> patches = {
        test::Rectangle({-2, -2, 0}, {4, 0, 0}, {0, 4, 0})};
    Append(patches, test::Bulb(center, kRadius, 6));
    const Scenery scenery(patches);
    BrightCell cell(0, basis, patches);
    const SourceGroups groups(cell.Geometry());
    const test::SourceAndTree source = cell.Source(&groups);
    RefineOptions options;
    options.tau = kTau;
    options.tau_weak = 0.5 * kTau;
    options.seed = static_cast<uint64_t>(place);
    for (const RawLinks& item :
         RefineAll(options, cell.Receiver(), source, scenery.All())) {
      for (const RawLink& link : item.links) {
        const PatchGeometry& floor = cell.Geometry()[0];
        if (link.receiver_patch != 0) {
          continue;
        }
        const TransferEnd end = MakeTransferEnd(
            floor, FrameOfPath(floor.shape, link.receiver_path));
        const double middle =
            std::hypot(static_cast<double>(end.center.x) - center.x,
                       static_cast<double>(end.center.y) - center.y);
        // Most of the circle through the element's corners lies in the bulb.
        // Half of the element's gain is wrong then; its nodes, test points and
        // rays may underestimate that fourfold.
        const auto diameter = static_cast<double>(end.diameter);
        if (middle + 0.5 * diameter < 1.2 * kRadius) {
          ++crossed;
          const auto largest = static_cast<double>(
              *std::max_element(link.gain.begin(), link.gain.end()));
          const double side = std::sqrt(static_cast<double>(end.area));
          EXPECT_LE(kReflectance * side * largest, 8 * kTau)
              << "place " << place << ", diameter " << diameter;
        }
      }
    }
  }
  EXPECT_GT(crossed, 0U);
}

// A small plate shines down on a large floor from inside a shade that all but
// touches the floor. All light that gets through the opening of the shade lands
// in a spot that is a thousandth of the floor. Everywhere else the plate is
// hidden.
TEST_P(FineLinks, OfAFloorBelowAShadeBringWhatIsInIt) {
  constexpr double kSide = 0.05;             // of the plate, m
  constexpr double kOpening = 0.06;          // likewise, of the shade
  constexpr double kBottom = 0.002;          // of the shade
  constexpr double kHeight = 0.05;           // of the plate
  constexpr Point3 kCorner = {2.7, 1.3, 0};  // of the shade
  constexpr double kRim = (kOpening - kSide) / 2;
  const Basis basis(GetParam());
  const double x = kCorner.x;
  const double y = kCorner.y;
  const Vec3 up = {0, 0, 1.2 * kHeight - kBottom};
  std::vector<Patch> patches = {
      test::Rectangle({0, 0, 0}, {4, 0, 0}, {0, 4, 0}),
      test::Rectangle(
          {x + kRim, y + kRim, kHeight}, {0, kSide, 0}, {kSide, 0, 0}),
      test::Rectangle({x, y, kBottom}, {kOpening, 0, 0}, up),
      test::Rectangle({x, y + kOpening, kBottom}, {kOpening, 0, 0}, up),
      test::Rectangle({x, y, kBottom}, {0, kOpening, 0}, up),
      test::Rectangle({x + kOpening, y, kBottom}, {0, kOpening, 0}, up)};
  const Scenery scenery(patches);
  BrightCell cell(0, basis, patches);
  constexpr ElementId kPlate{size_t{1}};
  cell.Tree().Sent().SetZero();
  std::fill_n(
      cell.Tree().Sent()[kPlate].begin(), cell.Tree().Shape().Stride(), 1.0F);
  cell.Tree().UpdateDetail();
  RefineOptions options;
  options.tau = 3e-4;
  options.tau_weak = 0.5 * options.tau;
  double flux = 0;
  double square_error = 0;
  for (const RawLinks& item :
       RefineAll(options, cell.Receiver(), cell.Source(), scenery.All())) {
    for (const RawLink& link : item.links) {
      if (link.receiver_patch == 0 && link.source_patch == kPlate.value) {
        const PatchGeometry& floor = cell.Geometry()[0];
        const ElementFrame frame = FrameOfPath(floor.shape, link.receiver_path);
        const auto area = static_cast<double>(AreaOf(floor, frame));
        flux += MeanGain(link) * area;
        square_error += options.tau * options.tau * area;
      }
    }
  }
  const auto opening = GeometryOf(
      {test::Rectangle({x, y, kBottom}, {kOpening, 0, 0}, {0, kOpening, 0})});
  const Corners corners = CornersOf(opening[0], {});
  constexpr int kSteps = 50;
  double passing = 0;
  for (int i = 0; i < kSteps; ++i) {
    for (int k = 0; k < kSteps; ++k) {
      const Vec3f p = {
          static_cast<float>(x + kRim + kSide * (i + 0.5) / kSteps),
          static_cast<float>(y + kRim + kSide * (k + 0.5) / kSteps),
          static_cast<float>(kHeight)};
      passing +=
          kSide * kSide / (kSteps * kSteps) *
          static_cast<double>(PointToPolygon(p, {0, 0, -1}, corners.View()));
    }
  }
  // The radiosity of a link may be wrong by tau over the root of its receiver's
  // area; the errors of links are independent.
  const double bound = std::sqrt(square_error) / kReflectance;
  EXPECT_LT(bound, 0.15 * passing);
  EXPECT_NEAR(flux, passing, bound);
}

// A wall is bright in one spot only, as behind a bulb, and a small plate lies
// in front of the spot. Seen from the plate the wall is bright, however small a
// part of the wall the spot is.
TEST_P(FineLinks, OfAWallWithASpotBringWhatTheSpotDoes) {
  constexpr size_t kLevels = 6;
  constexpr float kBrightness = 100;
  constexpr PatchId kWall{0U};
  constexpr uint32_t kPlate = 1;
  const Basis basis(GetParam());
  const std::vector<Patch> patches = {
      test::Rectangle({0, 0, 0}, {4, 0, 0}, {0, 4, 0}),
      test::Rectangle({0, 0, 0.1}, {0, 0.05, 0}, {0.05, 0, 0})};
  const Scenery scenery(patches);
  BrightCell cell(0, basis, patches);
  CellTree& tree = cell.Tree();
  // The spot is the element in the corner; the elements that contain it have
  // the mean of their children.
  std::vector<ElementId> holders = {ElementId(kWall.value)};
  ElementPath path = kRootPath;
  for (size_t level = 0; level < kLevels; ++level) {
    path = ChildPath(path, 0);
    holders.push_back(tree.FindOrCreate(kWall, path, cell.Geometry()));
  }
  tree.Sent().SetZero();
  float brightness = kBrightness;
  for (auto e = holders.rbegin(); e != holders.rend(); ++e) {
    std::fill_n(tree.Sent()[*e].begin(), tree.Shape().Stride(), brightness);
    brightness /= 4;
  }
  tree.UpdateDetail();

  RefineOptions options;
  options.tau = 0.02;
  options.tau_weak = 0.5 * options.tau;
  LinkBlock block;
  for (const RawLinks& item :
       RefineAll(options, cell.Receiver(), cell.Source(), scenery.All())) {
    cell.Link(item, &block);
  }
  SortLinks(&block);
  CoefficientArray& irradiance = cell.Received().gathered;
  Gather(block,
         {cell.Geometry(), &tree, nullptr},
         {cell.Geometry(), &tree, nullptr},
         tree.Sent(),
         irradiance);
  double gathered = 0;
  const PatchGeometry& plate = cell.Geometry()[kPlate];
  for (size_t i = 0; i < tree.Size(); ++i) {
    const Element& e = tree.At(ElementId(i));
    if (e.patch == kPlate) {
      const TransferEnd end = MakeTransferEnd(plate, e.frame);
      const auto values = irradiance[ElementId(i)];
      for (size_t g = 0; g < tree.Shape().NodeStride(); ++g) {
        const float weight = GetParam() == 1 ? 1.0F : end.nodes.weight[g];
        gathered += static_cast<double>(weight * values[g]) *
                    static_cast<double>(end.area / plate.area);
      }
    }
  }
  const TransferEnd receiver = MakeTransferEnd(plate, {});
  const TransferEnd source =
      MakeTransferEnd(cell.Geometry()[0], tree.At(holders.back()).frame);
  const Kernel kernel = NearKernel(receiver, source);
  double exact = 0;
  for (size_t i = 0; i < kernel.size(); ++i) {
    exact += static_cast<double>(receiver.nodes.weight[i / kTransferNodes] *
                                 kernel[i] * kBrightness);
  }
  // A few links are each off by tau, divided by rho and the root of the area.
  const double tolerance =
      2 * options.tau /
      (kReflectance * std::sqrt(static_cast<double>(plate.area)));
  EXPECT_GT(exact, 5 * tolerance);
  EXPECT_NEAR(gathered, exact, tolerance);
}

INSTANTIATE_TEST_SUITE_P(Orders, FineLinks, ::testing::Values(1, 2));

// The links of all parts in an order that does not depend on how the work was
// cut.
std::vector<RawLink> Sorted(const std::vector<RefinedPart>& parts) {
  std::vector<RawLink> all;
  for (const RefinedPart& part : parts) {
    all.insert(all.end(), part.out.links.begin(), part.out.links.end());
  }
  std::sort(all.begin(), all.end(), [](const RawLink& a, const RawLink& b) {
    return std::tie(a.receiver_patch,
                    a.receiver_path,
                    a.source_patch,
                    a.source_path) < std::tie(b.receiver_patch,
                                              b.receiver_path,
                                              b.source_patch,
                                              b.source_path);
  });
  return all;
}

// The work for a hall of a hundred thousand patches must not go through
// billions of pairs.
TEST(Refiner, ItemsOfWorkGrowWithTheReceiversAlone) {
  const Basis basis(2);
  const Scenery scenery({});
  const auto items = [&](int receivers, int sources) {
    const BrightCell floor(0, basis, Tiled(Floor(), receivers));
    const BrightCell ceiling(1, basis, Tiled(Ceiling(1), sources));
    return PairWork({}, floor.Receiver(), ceiling.Source()).Items().size();
  };
  const size_t few = items(16, 32);
  EXPECT_LE(items(16, 64), 2 * few) << "four times the sources";
  EXPECT_LE(items(16, 128), 2 * few) << "sixteen times the sources";
  EXPECT_GE(items(32, 32), 3 * few);
  EXPECT_LE(items(32, 32), 5 * few);
}

// A furnished room that is linked to itself finely.
class FinelyLinkedRoom : public ::testing::Test {
 protected:
  const Basis basis_{2};
  const std::vector<Patch> room_ = FurnishedRoom();
  const BrightCell cell_{0, basis_, room_};
  const Scenery scenery_{room_};
  const Refiner refiner_ = test::MakeRefiner({.tau = 0.01, .tau_weak = 0.005},
                                             cell_.Receiver(),
                                             cell_.Source(),
                                             scenery_.All());
};

// The sources are so many that refinement looks at a few at a time.
TEST(Refiner, HasTheSameLinksOfManySourcesHoweverTheWorkIsCut) {
  const Basis basis(2);
  const BrightCell floor(0, basis, Tiled(Floor(), 4));
  const BrightCell ceiling(1, basis, Tiled(Ceiling(0.1), 64));
  const Scenery scenery({});
  const Refiner refiner = test::MakeRefiner({.tau = 1e-4, .tau_weak = 5e-5},
                                            floor.Receiver(),
                                            ceiling.Source(),
                                            scenery.All());
  const auto whole = RefineInParts(refiner, SIZE_MAX);
  const auto expected = Sorted(whole);
  ASSERT_GT(expected.size(), 4096U);
  const auto parts = RefineInParts(refiner, 20);
  ASSERT_GT(parts.size(), whole.size());
  const auto links = Sorted(parts);
  ASSERT_EQ(links.size(), expected.size());
  for (size_t i = 0; i < links.size(); ++i) {
    EXPECT_EQ(links[i].source_patch, expected[i].source_patch);
    EXPECT_EQ(links[i].source_path, expected[i].source_path);
    EXPECT_EQ(links[i].receiver_path, expected[i].receiver_path);
    EXPECT_EQ(links[i].gain, expected[i].gain);
  }
}

TEST_F(FinelyLinkedRoom, HasTheSameLinksHoweverTheWorkIsCut) {
  const auto whole = RefineInParts(refiner_, SIZE_MAX);
  const auto expected = Sorted(whole);
  ASSERT_GT(expected.size(), 1000U);
  for (const size_t most : {size_t{500}, size_t{50}, size_t{5}}) {
    const auto parts = RefineInParts(refiner_, most);
    EXPECT_GT(parts.size(), whole.size());
    const auto links = Sorted(parts);
    ASSERT_EQ(links.size(), expected.size()) << most;
    for (size_t i = 0; i < links.size(); ++i) {
      ExpectSame(WithoutPlace(links[i]), WithoutPlace(expected[i]));
    }
  }
}

TEST_F(FinelyLinkedRoom, HasPartsBelowTheirLimit) {
  const auto parts = RefineInParts(refiner_, 50);
  EXPECT_GT(parts.size(), 1U);
  for (const RefinedPart& part : parts) {
    EXPECT_LE(part.out.links.size(), 50U);
  }
}

// A patch that is cared for n times as much gets the links of a solve with an
// n-th of tau; care does not scale the errors of the links.
TEST(Care, IsASmallerTauOfOnePatch) {
  const Basis basis(2);
  const std::vector<Patch> floor = Tiled(Floor(), 2);
  const std::vector<Patch> ceiling = Tiled(Ceiling(0.5), 3);
  const BrightCell receiver(0, basis, floor);
  const BrightCell source(1, basis, ceiling);
  std::vector<Patch> all = floor;
  Append(all, ceiling);
  all.push_back(test::Rectangle({0.2, 0.3, 0.3}, {0.4, 0, 0}, {0, 0.2, 0}));
  const Scenery scenery(all);
  constexpr uint32_t kCaredFor = 1;
  constexpr float kCare = 8;
  const auto links = [&](double tau, std::span<const PatchCare> care) {
    RefineOptions options;
    options.tau = tau;
    options.tau_weak = tau / 2;
    RefineReceiver cared = receiver.Receiver();
    cared.care = care;
    const std::vector<float> weights = WeighReceiver(cared);
    cared.weights = weights;
    std::array<std::vector<std::tuple<uint64_t, uint64_t, uint32_t>>, 2> made;
    double error = 0;
    for (const RawLinks& item :
         RefineAll(options, cared, source.Source(), scenery.All())) {
      for (const RawLink& link : item.links) {
        made[link.receiver_patch == kCaredFor ? 1 : 0].emplace_back(
            uint64_t{link.receiver_patch} << 32 | link.receiver_path,
            link.source_path,
            link.source_patch);
      }
      error += item.squared_error;
    }
    return std::make_pair(made, error);
  };
  std::vector<PatchCare> care(floor.size());
  care[kCaredFor].care = kCare;
  const auto [coarse, coarse_error] = links(0.02, {});
  const auto [fine, fine_error] = links(0.02 / 8, {});
  const auto [cared, cared_error] = links(0.02, care);
  EXPECT_EQ(cared[0], coarse[0]);
  EXPECT_EQ(cared[1], fine[1]);
  EXPECT_GT(cared[1].size(), 2 * coarse[1].size());
  EXPECT_LT(cared_error, coarse_error);
  EXPECT_GT(cared_error, fine_error);
}

// A leg stands below the rim of a seat and is lit by a lamp above: the rim
// hides the lamp from a strip of 5 mm at the top of the leg. Sixteen rays from
// an eighth of the leg find the strip every other time. The kernel asks for
// eighths; without the rim's outline, the elements would stay eighths.
TEST(Links, SeeTheNarrowShadowOfARim) {
  constexpr double kHeight = 1;
  constexpr double kRim = 0.0025;
  const Patch leg =
      test::Rectangle({0, 0, -kHeight}, {0.2, 0, 0}, {0, 0, kHeight});
  // Level, and seen from the leg's top at 63 degrees; faces down.
  const Patch lamp = test::Rectangle({0, -1.05, 2}, {0, 0.1, 0}, {0.2, 0, 0});
  const Patch rim =
      test::Rectangle({-0.5, -kRim, 0}, {0, kRim, 0}, {1.2, 0, 0});
  const Basis basis(2);
  const std::vector<Patch> legs = {leg};
  const std::vector<Patch> lamps = {lamp};
  const BrightCell receiver(0, basis, legs);
  const BrightCell source(1, basis, lamps);
  const Scenery scenery({leg, lamp, rim});
  RefineOptions options;
  options.tau_weak = 1e-9;
  // The transfer weighs 160 tau, and the transfer to an eighth of the leg 30.
  // The shadow is a twenty-fifth of the eighth and is unknown, so that it
  // weighs 2 tau.
  double transfer = 0;
  options.tau = 1;
  for (const RawLinks& item : RefineAll(
           options, receiver.Receiver(), source.Source(), Scenery({}).All())) {
    for (const RawLink& link : item.links) {
      transfer += MeanGain(link);
    }
  }
  options.tau = transfer * kReflectance * std::sqrt(kHeight * 0.2) / 160;
  // The height of the elements along the top, averaged over the top and the
  // seeds.
  constexpr int kSeeds = 32;
  double height = 0;
  for (int seed = 0; seed < kSeeds; ++seed) {
    options.seed = static_cast<uint64_t>(seed);
    std::map<float, double> along_top;  // by coordinate a
    for (const RawLinks& item : RefineAll(
             options, receiver.Receiver(), source.Source(), scenery.All())) {
      for (const RawLink& link : item.links) {
        const ElementFrame frame =
            FrameOfPath(PatchShape::kParallelogram, link.receiver_path);
        if (frame.b + frame.scale >= 1) {
          along_top[frame.a] = static_cast<double>(frame.scale);
        }
      }
    }
    for (const auto& [a, scale] : along_top) {
      height += scale * scale * kHeight / kSeeds;
    }
  }
  EXPECT_LT(height, 1.0 / 12);
}

// Half of the ceiling is hidden. Whichever rays let a link be accepted, the
// links together must bring half of what the bare ceiling would.
TEST(Links, KeepRaysThatDidNotDecideOnThem) {
  Patch plate = Ceiling(1 - 3e-4);
  plate.v = {0.5, 0, 0};
  const Basis basis(2);
  const std::vector<Patch> floor = {Floor()};
  const std::vector<Patch> ceiling = {Ceiling(1)};
  const BrightCell receiver(0, basis, floor);
  const BrightCell source(1, basis, ceiling);
  const Scenery scenery({Floor(), Ceiling(1), plate});
  // Coarse and fine: four rays decide for the first tau, sixteen for the
  // others.
  for (const double tau : {1.0, 0.05, 0.02}) {
    RefineOptions options;
    options.tau = tau;
    options.tau_weak = 1e-6;
    double sum = 0;
    double square = 0;
    constexpr int kSeeds = 4000;
    for (int seed = 0; seed < kSeeds; ++seed) {
      options.seed = MixKey(78, static_cast<uint64_t>(seed));
      double gain = 0;
      for (const RawLinks& item : RefineAll(
               options, receiver.Receiver(), source.Source(), scenery.All())) {
        for (const RawLink& link : item.links) {
          gain += MeanGain(link) *
                  std::pow(0.25, (std::bit_width(link.receiver_path) - 1) / 2);
        }
      }
      sum += gain;
      square += gain * gain;
    }
    const double mean = sum / kSeeds;
    const double error = std::sqrt((square / kSeeds - mean * mean) / kSeeds);
    // The nodes' kernel at this distance is good to 1 %.
    EXPECT_NEAR(mean, 0.199825 / 2, 3 * error + 0.01 * 0.1) << "tau " << tau;
    EXPECT_LT(3 * error, 0.01 * 0.1) << "tau " << tau;
  }
}

}  // namespace
}  // namespace enfilade
