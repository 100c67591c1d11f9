// What errors become by reflection, against closed forms.

#include "solver/residual/reflected_error.h"

#include "base/random.h"

#include <cmath>
#include <cstdint>
#include <vector>

#include <gtest/gtest.h>

namespace enfilade {
namespace {

constexpr double kSurfaceArea = 6;  // m2, of all surfaces
constexpr uint32_t kCells = 4;      // which see each other alike
constexpr int kProbes = 192;        // as many of each cell in each part

std::vector<CellInfo> Cells(size_t count) {
  std::vector<CellInfo> cells(count);
  for (size_t i = 0; i < count; ++i) {
    const auto x = static_cast<double>(i);
    cells[i].bounds = {{x, 0, 0}, {x + 1, 1, 1}};
  }
  return cells;
}

class ErrorOfCells {
 public:
  explicit ErrorOfCells(double reflectance)
      : reflectance_{reflectance, reflectance, reflectance},
        budget_(16ULL << 20),
        error_(Cells(kCells), budget_) {}

  // Adds probes with the residuals of their cells, and rays. The room is closed
  // if the shares of each cell's rays sum to 1.
  template <typename Residual, typename Share>
  ErrorIntegral Measure(int probes, Residual residual, Share share) {
    for (int i = 0; i < probes; ++i) {
      // Each cell gets sixteen probes in a row, so that each part has equally
      // many probes of a cell.
      const auto cell = static_cast<uint32_t>(i / 16) % kCells;
      const double r = residual(cell);
      const size_t group = GroupOf(cell);
      error_.AddProbe({group, kSurfaceArea, {r, r, r}, reflectance_});
      for (uint32_t to = 0; to < kCells; ++to) {
        error_.AddRay(
            group, GroupOf(to), kSurfaceArea * share(cell, to), reflectance_);
      }
    }
    return error_.Integral();
  }

 private:
  [[nodiscard]] size_t GroupOf(uint32_t cell) const {
    return error_.GroupOf(CellId(cell), {cell + 0.25, 0.25, 0.25}, false);
  }

  Rgb reflectance_;
  MemoryBudget budget_;
  ReflectedError error_;
};

double Alike(uint32_t, uint32_t) {
  return 1.0 / kCells;
}

// In a closed room an even residual r is an error of r / (1 - rho).
TEST(ReflectedError, GrowsInAClosedRoomAsLightDoes) {
  for (const double rho : {0.0, 0.5, 0.9}) {
    const double r = 0.3;
    const ErrorIntegral added = ErrorOfCells(rho).Measure(
        kProbes, [=](uint32_t) { return r; }, Alike);
    const double whole = r / (1 - rho);
    EXPECT_NEAR(added.value, kSurfaceArea * (whole * whole - r * r), 1e-9)
        << rho;
    EXPECT_NEAR(added.deviation, 0, 1e-6) << "all parts agree";
  }
}

// No light comes back from the outside.
TEST(ReflectedError, IsLessWhereLightEscapes) {
  const auto half = [](uint32_t, uint32_t) { return 0.5 / kCells; };
  const ErrorIntegral added = ErrorOfCells(0.8).Measure(
      kProbes, [](uint32_t) { return 1.0; }, half);
  const double whole = 1 / (1 - 0.4);
  EXPECT_NEAR(added.value, kSurfaceArea * (whole * whole - 1), 1e-9);
}

// Two sides see only each other; one is too bright and the other too dark by as
// much. Their errors mend each other: e = r / (1 + rho).
TEST(ReflectedError, OfOppositeSignsShrinks) {
  const auto other = [](uint32_t from, uint32_t to) {
    return (from ^ to) == 1 ? 1.0 : 0.0;
  };
  const ErrorIntegral added = ErrorOfCells(0.5).Measure(
      kProbes, [](uint32_t cell) { return cell % 2 == 0 ? 1.0 : -1.0; }, other);
  const double whole = 1 / 1.5;
  EXPECT_NEAR(added.value, kSurfaceArea * (whole * whole - 1), 1e-9);
}

// Residuals of zero mean have no light to reflect, however much they scatter:
// the halves are independent, so that on the average nothing is added.
TEST(SlowReflectedError, IsNotFooledByScatter) {
  constexpr int kRuns = 400;
  double sum = 0;
  double squares = 0;
  for (uint64_t seed = 0; seed < kRuns; ++seed) {
    Random random(seed);
    const double added =
        ErrorOfCells(0.9)
            .Measure(
                64, [&](uint32_t) { return 2 * random.Next() - 1; }, Alike)
            .value;
    sum += added;
    squares += added * added;
  }
  const double mean = sum / kRuns;
  const double deviation = std::sqrt((squares / kRuns - mean * mean) / kRuns);
  EXPECT_LE(std::abs(mean), 4 * deviation);
  EXPECT_LE(4 * deviation, 0.5 * kSurfaceArea) << "which would say nothing";
}

// In a white room the whole error is one number, the mean; the deviation says
// how far the mean may be off. With 16 parts, Student's t has 15 degrees of
// freedom and exceeds twice the deviation in 6.4 % of all runs. (With two parts
// it exceeds that in 30 %, since two numbers often agree by chance.)
TEST(SlowReflectedError, KnowsHowSureItIs) {
  constexpr int kRuns = 400;
  constexpr double kMean = 0.2;
  int off = 0;
  for (uint64_t seed = 0; seed < kRuns; ++seed) {
    Random random(seed);
    const ErrorIntegral added = ErrorOfCells(0.9).Measure(
        kProbes, [&](uint32_t) { return kMean + random.Next() - 0.5; }, Alike);
    // The error e is 10 r; the integral leaves out the part of r itself.
    const double expected = kSurfaceArea * (100 - 1) * kMean * kMean;
    off += std::abs(added.value - expected) > 2 * added.deviation ? 1 : 0;
  }
  EXPECT_LE(off, kRuns / 10);
}

// Light that stays in a slot is reflected there again and again, whatever the
// room in front of it does.
TEST(ReflectedError, WhatIsNarrowIsItsOwn) {
  MemoryBudget budget(16ULL << 20);
  const auto cells = Cells(1);
  ReflectedError error(cells, budget);
  const Point3 at = {0.25, 0.25, 0.25};
  const size_t slot = error.GroupOf(CellId(0U), at, true);
  const size_t room = error.GroupOf(CellId(0U), at, false);
  ASSERT_NE(slot, room);
  EXPECT_GT(error.NarrowBelow(CellId(0U)), 0.0);
  EXPECT_LT(error.NarrowBelow(CellId(0U)), 1.0);
  constexpr double kRho = 0.95;
  constexpr double kResidual = 0.1;
  for (int i = 0; i < 160; ++i) {
    const bool in_slot = i / 16 % 10 == 0;
    const size_t group = in_slot ? slot : room;
    const double r = in_slot ? kResidual : 0.0;
    error.AddProbe({group, kSurfaceArea, {r, r, r}, {kRho, kRho, kRho}});
    error.AddRay(group,
                 group,
                 in_slot ? kSurfaceArea : 0.5 * kSurfaceArea,
                 {kRho, kRho, kRho});
  }
  const double whole = kResidual / (1 - kRho);
  EXPECT_NEAR(error.Integral().value,
              kSurfaceArea / 10 * (whole * whole - kResidual * kResidual),
              1e-9);
}

// Half of what the probes of a group see is black: it belongs to the group, but
// sends no error back.
TEST(ReflectedError, BlackSurfacesSendNothingBack) {
  MemoryBudget budget(16ULL << 20);
  ReflectedError error(Cells(1), budget);
  const size_t group = error.GroupOf(CellId(0U), {0.25, 0.25, 0.25}, true);
  constexpr double kRho = 0.8;
  constexpr double kResidual = 0.1;
  for (int i = 0; i < 160; ++i) {
    error.AddProbe({group,
                    kSurfaceArea,
                    {kResidual, kResidual, kResidual},
                    {kRho, kRho, kRho}});
    error.AddRay(group, group, 0.5 * kSurfaceArea, {kRho, kRho, kRho});
    error.AddRay(group, group, 0.5 * kSurfaceArea, {0, 0, 0});
  }
  const double whole = kResidual / (1 - kRho / 2);
  EXPECT_NEAR(error.Integral().value,
              kSurfaceArea * (whole * whole - kResidual * kResidual),
              1e-9);
}

TEST(ReflectedError, LongCellsHaveSeveralGroups) {
  MemoryBudget budget(16ULL << 20);
  std::vector<CellInfo> tube(1);
  tube[0].bounds = {{0, 0, 0}, {8, 0.5, 0.5}};
  const ReflectedError error(tube, budget);
  const auto group = [&](double x) {
    return error.GroupOf(CellId(0U), {x, 0.1, 0}, false);
  };
  EXPECT_EQ(group(0.05), group(0.06));
  EXPECT_NE(group(0.05), group(0.95));
  EXPECT_NE(group(0.05), group(7.95));
  EXPECT_EQ(group(7.95), group(8.0001)) << "on the rim";
}

TEST(ReflectedError, TakesAnyNumberOfCells) {
  for (const size_t count : {1U, 255U, 256U, 257U, 10000U}) {
    MemoryBudget budget(16ULL << 20);
    ReflectedError error(Cells(count), budget);
    for (const size_t i : {size_t{0}, count / 2, count - 1}) {
      const size_t group = error.GroupOf(
          CellId(i), {static_cast<double>(i) + 0.5, 0.5, 0}, false);
      ASSERT_LT(group, 256U) << i << " of " << count;
      for (int half = 0; half < 2; ++half) {
        error.AddProbe({group, 1, {1, 1, 1}, {0.5, 0.5, 0.5}});
        error.AddRay(group, group, 1, {0.5, 0.5, 0.5});
      }
    }
    EXPECT_GT(error.Integral().value, 0);
  }
}

}  // namespace
}  // namespace enfilade
