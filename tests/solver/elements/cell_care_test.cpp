// How much more carefully some patches are refined than others.

#include "solver/elements/cell_care.h"

#include "base/error.h"
#include "base/memory.h"
#include "solver/residual/patch_errors.h"
#include "store/sqlite_store.h"

#include <array>
#include <cmath>
#include <numeric>
#include <vector>

#include "tests/budgets.h"
#include <gtest/gtest.h>

namespace enfilade {
namespace {

TEST(CellCare, IsOneUntilItIsStored) {
  const auto store = CreateStoreInMemory();
  for (const PatchCare& care : LoadCellCare(*store, CellId(3U), 4)) {
    EXPECT_EQ(care.care, 1);
    EXPECT_EQ(care.links, 0U);
  }
  const CellCare care = {{2, 70}, {1, 0}};
  SaveCellCare(care, CellId(3U), *store);
  const CellCare read = LoadCellCare(*store, CellId(3U), 2);
  EXPECT_EQ(read[0].care, 2);
  EXPECT_EQ(read[0].links, 70U);
  EXPECT_EQ(LoadCellCare(*store, CellId(4U), 1)[0].care, 1);
}

TEST(CellCare, OfAnotherCellIsRefused) {
  const auto store = CreateStoreInMemory();
  SaveCellCare(CellCare(2), CellId(0U), *store);
  EXPECT_THROW(LoadCellCare(*store, CellId(0U), 3), DamagedStoreError);
}

TEST(CellCare, NothingIsRaisedWhereTheErrorIsSmallEnough) {
  const std::vector<LinkErrors> known = {{1, 10}, {5, 1}};
  const double level = LevelOfErrors(known, {1, 100}, 1);
  CellCare care(2);
  EXPECT_EQ(RaiseOfCare(known[1], level), 1);
  EXPECT_EQ(RaiseCare(std::vector<float>{1, 5}, level, 1, &care), 0);
  EXPECT_EQ(care[1].care, 1);
}

// The squared error of a patch falls with the 1.3th root of tau; at the level
// sought, the squared errors of all patches add up to what is wanted.
TEST(CellCare, TheLevelLeavesWhatIsWanted) {
  const std::vector<LinkErrors> known = {{4, 10}, {2, 20}, {1, 200}};
  const LinkErrors rest = {1, 10000};
  for (const double left : {0.9, 0.6, 0.3}) {
    const double level = LevelOfErrors(known, rest, left);
    const auto square = [&](const LinkErrors& errors) {
      return errors.square * std::pow(RaiseOfCare(errors, level), -1 / 1.3);
    };
    double sum = square(rest);
    for (const LinkErrors& errors : known) {
      sum += square(errors);
    }
    EXPECT_NEAR(sum, 8 * left, 0.02 * 8 * left);
    EXPECT_GE(RaiseOfCare(known[0], level), RaiseOfCare(known[1], level));
    EXPECT_EQ(RaiseOfCare(rest, level), 1) << "others are worse";
  }
}

TEST(CellCare, WhereAllErrAlikeOnlyTauIsLowered) {
  const std::vector<LinkErrors> known(3, {1, 10});
  const LinkErrors rest = {100, 1000};
  for (const double left : {0.5, 1e-9}) {
    const double level = LevelOfErrors(known, rest, left);
    const double by_tau = RaiseOfCare(rest, level);
    EXPECT_GT(by_tau, 1);
    CellCare care(1, {1, 10});
    EXPECT_EQ(RaiseCare(std::vector<float>{1}, level, by_tau, &care), 0);
    EXPECT_EQ(care[0].care, 1);
  }
}

TEST(CellCare, IsRaisedWhereTheErrorIsAndStays) {
  CellCare care = {{1, 100}, {3, 100}, {1, 100}};
  const std::vector<float> square = {0, 9, 1};
  const LinkErrors rest = {0, 1000};
  const double level =
      LevelOfErrors(std::vector<LinkErrors>{{9, 100}, {1, 100}}, rest, 0.5);
  const double gone = RaiseCare(square, level, 1, &care);
  EXPECT_NEAR(gone, 5, 0.2);
  EXPECT_EQ(care[0].care, 1);
  EXPECT_GT(care[1].care, 3);
  EXPECT_EQ(care[2].care, 1);
  const float raised = care[1].care;
  RaiseCare(std::vector<float>(3), level, 1, &care);
  EXPECT_EQ(care[1].care, raised);
}

// ------------------------------------------------------- errors by patch

// Two cells, of two patches and of one.
class ProbedPatches : public ::testing::Test {
 protected:
  static constexpr std::array<uint32_t, 2> kFirst = {0, 2};

  MemoryBudget budget_{kModest};
  PatchErrors errors_{kFirst, 8192, budget_};
};

TEST_F(ProbedPatches, OneProbeSaysNothingOfAPatchButOfAll) {
  errors_.Add(CellId(0U), PatchId(1U), 0.5, 6);
  errors_.Sort();
  EXPECT_EQ(errors_.Of(CellId(0U), 2), std::vector<float>(2));
  EXPECT_EQ(errors_.OfAll(), 6);
}

// Each patch gets probes in proportion to its share; the value of a probe is
// the integral over the patch divided by that share.
TEST_F(ProbedPatches, ManyProbesAddUpToTheWhole) {
  constexpr std::array<double, 3> kSquare = {2, 0.5, 7};
  constexpr std::array<double, 3> kShare = {0.5, 0.375, 0.125};
  constexpr int kProbes = 8000;
  for (size_t p = 0; p < kSquare.size(); ++p) {
    for (int i = 0; i < kProbes * kShare[p]; ++i) {
      errors_.Add(CellId(p < 2 ? 0U : 1U),
                  PatchId(p < 2 ? p : 0U),
                  kShare[p],
                  kSquare[p] / kShare[p]);
    }
  }
  errors_.Sort();
  EXPECT_NEAR(errors_.OfAll(), 9.5, 1e-9);
  std::vector<float> seen = errors_.Of(CellId(0U), 2);
  seen.push_back(errors_.Of(CellId(1U), 1)[0]);
  // One standard deviation is subtracted: one over the root of the number of
  // probes, as a share.
  for (size_t p = 0; p < kSquare.size(); ++p) {
    const double known = 1 - 1 / std::sqrt(kProbes * kShare[p]);
    EXPECT_NEAR(seen[p], kSquare[p] * known, 1e-4 * kSquare[p]);
  }
}

// If the probes of a patch differ in sign, the patch is as likely right as
// wrong.
TEST_F(ProbedPatches, NoiseIsNoError) {
  for (int i = 0; i < 10; ++i) {
    errors_.Add(CellId(1U), PatchId(0U), 0.3, i % 2 == 0 ? 5 : -4);
  }
  errors_.Sort();
  EXPECT_EQ(errors_.Of(CellId(1U), 1)[0], 0);
}

}  // namespace
}  // namespace enfilade
