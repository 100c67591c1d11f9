// Transfers in which one end lies on both sides of the other's plane: the
// visible part may be a corner that holds neither nodes nor test points. The
// tests compare the light with exact form factors of points.

#include "base/random.h"
#include "solver/refine/apply_links.h"
#include "solver/refine/refiner.h"
#include "solver/transfer/fit_residual.h"
#include "solver/transfer/form_factor.h"
#include "solver/transfer/oracle.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "tests/solver/test_cells.h"
#include "tests/solver/test_refinement.h"
#include "tests/visibility/test_rooms.h"
#include <gtest/gtest.h>

namespace enfilade {
namespace {

using test::BrightCell;
using test::RandomPatch;
using test::Scenery;

constexpr double kLampTau = 2e-4;  // W/m
constexpr int kLampPlaces = 60;
constexpr int kPointsPerPlace = 4000;

// A lamp of some 20 cm in the plane z = 0, shining up.
Patch Lamp(Random& random) {
  Patch lamp = test::Rectangle({-0.1, -0.1, 0}, {0.2, 0, 0}, {0, 0.2, 0});
  lamp.shape = random.NextBelow(2) == 0 ? PatchShape::kParallelogram
                                        : PatchShape::kTriangle;
  return lamp;
}

// A patch of up to 20 cm in a random orientation, near the lamp. The whole lamp
// lies in front of the patch, and a corner, an edge or more of the patch lies
// above the lamp's plane.
Patch PlateAcross(Random& random) {
  constexpr double kGap = 0.02;  // m
  const std::array<Point3, 4> lamp = {
      {{-0.1, -0.1, 0}, {0.1, -0.1, 0}, {-0.1, 0.1, 0}, {0.1, 0.1, 0}}};
  while (true) {
    Patch plate = RandomPatch(random, 0, 0.2);
    plate.origin = {0.5 * random.Next() - 0.25,
                    0.5 * random.Next() - 0.25,
                    0.2 * random.Next() - 0.1};
    const bool faces = std::all_of(lamp.begin(), lamp.end(), [&](Point3 p) {
      return Dot(p - plate.origin, PatchNormal(plate)) > kGap;
    });
    const double z = plate.origin.z;
    const auto [low, high] = std::minmax({z, z + plate.u.z, z + plate.v.z});
    if (faces && low < -0.01 && high > 0.01) {
      return plate;
    }
  }
}

// What the links to the elements of a patch bring to a point of it.
double GainAt(BrightCell& cell, const Basis& basis, UnitPoint at) {
  const PatchShape shape = cell.Geometry()[0].shape;
  double gain = 0;
  for (ElementId id(size_t{0});;) {
    const auto functions = basis.On(shape).Evaluate(at);
    const auto nodes = cell.Received().gain[id];
    for (size_t g = 0; g < basis.On(shape).NodeCount(); ++g) {
      gain += functions[g] * static_cast<double>(nodes[g]);
    }
    const Element& element = cell.Tree().At(id);
    if (element.first_child == 0) {
      return gain;
    }
    id = ElementId(element.first_child + ChildAt(shape, &at));
  }
}

struct Errors {
  double seen = 0;       // W/m: reflected, root of the integral of the square
  double predicted = 0;  // likewise, by refinement
};

// The errors of links from one patch of 1 W/m2 to another in an empty scene.
Errors ErrorsOfLinks(const Patch& receiver,
                     const Patch& source,
                     const Basis& basis,
                     Random& random) {
  const Scenery scenery({receiver, source});
  BrightCell to(0, basis, {receiver});
  BrightCell from(1, basis, {source});
  RefineOptions options;
  options.tau = kLampTau;
  options.tau_weak = 0.5 * kLampTau;
  const Refiner refiner =
      test::MakeRefiner(options, to.Receiver(), from.Source(), scenery.All());
  LinkBlock block;
  Errors errors;
  for (size_t item = 0; item < refiner.ItemCount(); ++item) {
    RawLinks raw;
    refiner.Refine({.item = item}, {}, &raw);
    errors.predicted += raw.squared_error;
    ApplyLinks(raw,
               {to.Geometry(), &to.Tree()},
               {from.Geometry(), &from.Tree()},
               &to.Received(),
               &block);
  }
  errors.predicted = std::sqrt(errors.predicted);
  const PatchGeometry& r = to.Geometry()[0];
  const PatchGeometry& s = from.Geometry()[0];
  const Corners corners = CornersOf(s, {});
  double square = 0;
  for (int i = 0; i < kPointsPerPlace; ++i) {
    UnitPoint at{random.Next(), random.Next()};
    if (r.shape == PatchShape::kTriangle && at.a + at.b > 1) {
      at = {1 - at.a, 1 - at.b};
    }
    const Vec3f x =
        PointOn(r, {}, static_cast<float>(at.a), static_cast<float>(at.b));
    const bool in_front = Dot(x - s.origin, s.normal) > 0;
    const auto exact =
        in_front
            ? static_cast<double>(PointToPolygon(x, r.normal, corners.View()))
            : 0.0;
    const double off = GainAt(to, basis, at) - exact;
    square += off * off / kPointsPerPlace;
  }
  errors.seen =
      test::kReflectance * std::sqrt(square * static_cast<double>(r.area));
  return errors;
}

class CutTransfersOfOrder : public ::testing::TestWithParam<size_t> {
 protected:
  // Checks that over many places the errors are those that refinement predicts,
  // together within a quarter and nowhere as much as twice.
  template <typename Link>
  void ExpectPredictedErrors(const Link& link) {
    double seen = 0;
    double predicted = 0;
    for (int place = 0; place < kLampPlaces; ++place) {
      const Errors errors = link();
      EXPECT_LT(errors.seen, 2 * std::max(errors.predicted, kLampTau))
          << "place " << place;
      seen += errors.seen * errors.seen;
      predicted += errors.predicted * errors.predicted;
    }
    EXPECT_LT(std::sqrt(seen), 1.25 * std::sqrt(predicted));
  }

  Basis basis_{GetParam()};
  Random random_{2718};
};

TEST_P(CutTransfersOfOrder, LightAPlateThatCrossesThePlaneOfALamp) {
  ExpectPredictedErrors([&] {
    const Patch plate = PlateAcross(random_);
    return ErrorsOfLinks(plate, Lamp(random_), basis_, random_);
  });
}

TEST_P(CutTransfersOfOrder, LightAPlateByThePartOfALampAboveItsHorizon) {
  ExpectPredictedErrors([&] {
    const Patch lamp = PlateAcross(random_);
    return ErrorsOfLinks(Lamp(random_), lamp, basis_, random_);
  });
}

INSTANTIATE_TEST_SUITE_P(Orders, CutTransfersOfOrder, ::testing::Values(1, 2));

// The gap between the surfaces is closed to rays: each surface is seen through
// the other, so the two must not send each other light as well.
TEST(CutTransfers, SurfacesThatNearlyTouchSendEachOtherNothing) {
  const auto exchange = [](double gap, double tilt) {
    const auto patches = test::GeometryOf(
        {test::Rectangle({0, 0, 0}, {1, 0, 0}, {0, 1, 0}),
         test::Rectangle(
             {0.2, 0.2, gap}, {0, 0.3, tilt * 0.3}, {0.3, 0, tilt * 0.3})});
    const TransferEnd r = MakeTransferEnd(patches[0], {});
    const TransferEnd s = MakeTransferEnd(patches[1], {});
    return !IsBehind(s, patches[0]) && !IsBehind(r, patches[1]);
  };
  EXPECT_FALSE(exchange(1e-4, 0));
  EXPECT_FALSE(exchange(1e-4, 1e-4));
  EXPECT_TRUE(exchange(4e-4, 0));
  EXPECT_TRUE(exchange(1e-4, 0.1)) << "open at one side";
}

// From afar, plain quadrature serves whole sources, but a corner above the
// horizon may have no node: the transfer must know that corner.
TEST(CutTransfers, KnowWhatIsAboveTheHorizonFromAfar) {
  Random random(1618);
  int missed = 0;
  for (int place = 0; place < 500;) {
    const Patch small =
        test::Rectangle({-0.01, -0.01, 0}, {0.02, 0, 0}, {0, 0.02, 0});
    Patch source = RandomPatch(random, 0, 0.3);
    source.origin = {1, random.Next() - 0.5, 0.3 * random.Next() - 0.15};
    const auto patches = test::GeometryOf({small, source});
    RadiantEnd s;
    s.end = MakeTransferEnd(patches[1], {});
    s.radiosity.fill(1);
    const TransferEnd r = MakeTransferEnd(patches[0], {});
    if (!IsCut(s.end, patches[0]) || IsCut(r, patches[1]) ||
        IsBehind(r, patches[1])) {
      continue;
    }
    ++place;
    const Corners corners = CornersOf(patches[1], {});
    const float exact = PointToPolygon({0, 0, 0}, {0, 0, 1}, corners.View());
    // The form factor varies over a receiver of 2 cm by some (2 / 70)^2.
    EXPECT_NEAR(JudgeTransfer(r, s).form_factor, exact, 0.01F * exact + 1e-8F);
    const Kernel plain = QuadratureKernel(r, s.end);
    missed += *std::max_element(plain.begin(), plain.end()) > 0 ? 0 : 1;
  }
  EXPECT_GT(missed, 10);
}

// ----------------------------------------------------------------- geometry

TEST(IsCut, TellsOneSideFromBoth) {
  for (uint64_t i = 0; i < 2000; ++i) {
    const auto patches =
        test::GeometryOf(test::RandomPatches(MixKey(31, i), 2, 0.3, 0.5));
    const TransferEnd end = MakeTransferEnd(patches[0], {});
    const Corners corners = CornersOf(patches[0], {});
    float lowest = 1e9F;
    float highest = -1e9F;
    for (const Vec3f p : corners.View()) {
      const float height = Dot(p - patches[1].origin, patches[1].normal);
      lowest = std::min(lowest, height);
      highest = std::max(highest, height);
    }
    const float tolerance = PlaneTolerance(patches[1]);
    EXPECT_EQ(IsCut(end, patches[1]),
              lowest < -tolerance && highest > tolerance);
  }
}

TEST(IsCut, IsNotWhatTouches) {
  const auto walls = test::GeometryOf(test::BoxPatches(test::kRoom, true));
  for (const PatchGeometry& a : walls) {
    for (const PatchGeometry& b : walls) {
      EXPECT_FALSE(IsCut(MakeTransferEnd(a, {}), b));
    }
  }
}

TEST(CornerAlong, IsTheFarthestCorner) {
  Random random(97);
  for (uint64_t i = 0; i < 2000; ++i) {
    const auto patches =
        test::GeometryOf(test::RandomPatches(MixKey(97, i), 1, 0.3, 0.5));
    const PatchGeometry& patch = patches[0];
    ElementFrame frame;
    for (int level = 0; level < 3; ++level) {
      frame = ChildOf(frame, patch.shape, random.NextBelow(4));
    }
    const TransferEnd end = MakeTransferEnd(patch, frame);
    const Vec3f direction = ToFloat(RandomDirection(random));
    const UnitPoint at = CornerAlong(end, direction);
    const float found = Dot(
        PointOn(
            patch, frame, static_cast<float>(at.a), static_cast<float>(at.b)),
        direction);
    float farthest = -1e9F;
    const Corners corners = CornersOf(patch, frame);
    for (const Vec3f p : corners.View()) {
      farthest = std::max(farthest, Dot(p, direction));
    }
    // The corner that is found keeps off the rim by 3 % along each edge.
    EXPECT_NEAR(found, farthest, 0.1F * end.diameter);
    EXPECT_LT(found, farthest + 1e-6F);
  }
}

}  // namespace
}  // namespace enfilade
