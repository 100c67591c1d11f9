#include "tools/compare_fields.h"

#include "base/error.h"

#include <cmath>

#include "tests/tools/verify_fake_building.h"
#include <gtest/gtest.h>

namespace enfilade {
namespace {

// A room of 4 x 3 x 2 m, all walls of reflectance 1/2 and exitance 1, so that
// the field 2 reflects 1 everywhere.
class CompareTest : public ::testing::Test {
 protected:
  CompareTest() {
    building_.AddRoom({4, 3, 2},
                      building_.AddMaterial({.5, .5, .5}, {1, 1, 1}));
  }

  CompareSummary Against2(const FakeBuilding::Field& field) {
    building_.SetRadiosity(field);
    const RadiosityField a = building_.View().radiosity;
    const RadiosityField b = [](std::span<const PatchPoint> points) {
      return std::vector<Rgb>(points.size(), Rgb{2, 2, 2});
    };
    CompareSummary s = CompareFields(building_.View(), a, b, options_, budget_);
    EXPECT_EQ(budget_.UsedBytes(), 0U);
    return s;
  }

  FakeBuilding building_;
  CompareOptions options_;
  MemoryBudget budget_{64ULL << 20};
};

TEST_F(CompareTest, EqualFieldsHaveNoError) {
  const CompareSummary s = Against2([](const Patch&, Point3) {
    return Rgb{2, 2, 2};
  });
  EXPECT_EQ(s.rms_error, 0);
  EXPECT_EQ(s.l1_error, 0);
  EXPECT_EQ(s.max_error, 0);
  EXPECT_EQ(s.mean_deviation, 0);
  EXPECT_NEAR(s.mean_reflected, 1, 1e-12);
}

TEST_F(CompareTest, AConstantOffsetHasAllErrorsEqual) {
  const CompareSummary s = Against2([](const Patch&, Point3) {
    return Rgb{1.9, 1.9, 1.9};
  });
  EXPECT_NEAR(s.rms_error, .1, 1e-12);
  EXPECT_NEAR(s.l1_error, .1, 1e-12);
  EXPECT_NEAR(s.max_error, .1, 1e-12);
  EXPECT_NEAR(s.mean_deviation, -.1, 1e-12);
}

TEST_F(CompareTest, AnErrorInOneChannelIsAThirdOfTheSquares) {
  const CompareSummary s = Against2([](const Patch&, Point3) {
    return Rgb{2, 2.3, 2};
  });
  EXPECT_NEAR(s.rms_error, .3 / std::sqrt(3.0), 1e-12);
  EXPECT_NEAR(s.l1_error, .1, 1e-12);
  EXPECT_NEAR(s.max_error, .3, 1e-12);
}

// Errors are weighed by area, not by patch: the two 4 x 3 m faces are 24 of 52
// m2.
TEST_F(CompareTest, ErrorsAreWeighedByArea) {
  const CompareSummary s = Against2([](const Patch& patch, Point3) {
    const double b = PatchArea(patch) == 12 ? 2.1 : 2;
    return Rgb{b, b, b};
  });
  EXPECT_NEAR(s.rms_error, .1 * std::sqrt(24.0 / 52), 1e-12);
  EXPECT_NEAR(s.mean_deviation, .1 * 24 / 52, 1e-12);
}

// Over the floor and ceiling, x is uniform in [0, 4]: the mean square of
// sin(pi x / 2) is 1/2. Stratified samples of a smooth function are far better
// than 1 % at a thousand points a face.
TEST_F(CompareTest, ASmoothErrorIsIntegratedToOnePercent) {
  const CompareSummary s = Against2([](const Patch& patch, Point3 x) {
    const double d = PatchArea(patch) == 12 ? std::sin(kPi * x.x / 2) : 0;
    return Rgb{2 + d, 2 + d, 2 + d};
  });
  EXPECT_NEAR(s.rms_error, std::sqrt(.5 * 24 / 52), .01 * s.rms_error);
  EXPECT_NEAR(s.mean_deviation, 0, .005);
  // Each face, of 12, 8 or 6 m2, has one point per 100 cm2 in a square grid.
  EXPECT_EQ(s.points, 2U * (32 * 32 + 29 * 29 + 25 * 25));
}

TEST_F(CompareTest, ADarkReferenceIsRefused) {
  const RadiosityField dark = [](std::span<const PatchPoint> points) {
    return std::vector<Rgb>(points.size(), Rgb{1, 1, 1});
  };
  EXPECT_THROW(CompareFields(building_.View(), dark, dark, options_, budget_),
               InputError);
}

}  // namespace
}  // namespace enfilade
