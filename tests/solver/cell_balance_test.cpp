// The light of a cell whose walls send to themselves, which has a closed form.

#include "solver/cell_balance.h"

#include "solver/links/link_codes.h"
#include "solver/links/link_store.h"
#include "solver/state/held_gain.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include "tests/budgets.h"
#include "tests/solver/row_of_rooms.h"
#include <gtest/gtest.h>

namespace enfilade {
namespace {

constexpr CellId kBalanced(0U);
constexpr double kWalls = 6;  // of 1 m2 each
constexpr double kGlow = 1;   // W/m2
constexpr double kGrey = 0.5;
// With so little unsent light the cell is settled.
constexpr double kUnsentW = 1e-4;

Material GlowingGrey() {
  Material material;
  material.reflectance = {kGrey, kGrey, kGrey};
  material.exitance = {kGlow, kGlow, kGlow};
  return material;
}

// A room in which each wall has one link, from itself. The light of a wall is
//
//   B = E + rho g k B = E / (1 - rho g k),    W/m2
//
// with the link's gain g and the share k of it that is kept, if rho g k < 1.
class SelfLinkedRoom : public ::testing::Test {
 protected:
  // Begins where refinement ends: the links have brought what was emitted.
  void StartWith(double rho_gain, double radius) {
    const uint16_t code =
        EncodeCoefficient(static_cast<float>(rho_gain / kGrey));
    LinkBlock links;
    for (uint32_t wall = 0; wall < static_cast<uint32_t>(kWalls); ++wall) {
      links.links.push_back({wall, wall, LinkKind::kWeak, code, 0});
    }
    ChunkWriter writer(*row_.store, [](LinkChunk&& /*chunk*/) {});
    writer.Start({{kBalanced, kBalanced}, 0, std::move(links), 0});
    writer.Finish();
    pager_ = std::make_unique<CellPager>(*row_.store,
                                         row_.scene,
                                         row_.partition,
                                         TreeShape{&basis_, kRgbChannels},
                                         device_,
                                         budget_);
    pager_->Order().StartSweep(SweepKind::kPropagate);
    pager_->StartTurn(kBalanced, LoadVisibleSet(*row_.store, kBalanced));
    geometry_ = pager_->Geometry(kBalanced);
    tree_ = pager_->Tree(kBalanced);
    delta_ = pager_->Delta(kBalanced);
    received_ = pager_->Received(kBalanced);
    gain_ = DecodeCoefficient(code);
    Fill(gain_, &received_->gain);
    Fill(gain_ * static_cast<float>(kGlow), &received_->gathered);
    cell_row_.radius = radius;
    balance_ = std::make_unique<CellBalance>(BalancedCell{kBalanced,
                                                          geometry_.get(),
                                                          tree_.get(),
                                                          delta_.get(),
                                                          received_.get(),
                                                          &cell_row_},
                                             surfaces_,
                                             *pager_,
                                             *row_.store,
                                             &times_);
  }

  static void Fill(float value, CoefficientArray* array) {
    for (size_t i = 0; i < array->Size(); ++i) {
      for (float& v : (*array)[ElementId(i)]) {
        v = value;
      }
    }
  }

  bool RunCycle() {
    ++cycles_;
    const bool is_settled = balance_->RunCycle(kUnsentW);
    most_sent_ =
        std::max(most_sent_, static_cast<double>(tree_->Sent().MaxAbs()));
    return is_settled;
  }

  // Runs cycles until the light has settled, as many as the engine would.
  void Settle() {
    while (!RunCycle()) {
      ASSERT_LT(cycles_, 40);
    }
  }

  // The light of all walls if this product of reflectance, gain and share is
  // less than 1. Of what is not yet sent, each reflection leaves the product,
  // so that it stands for 1 / (1 - product) of itself. So do the roundings of
  // what is sent and gathered, by 2^-24 of their largest in each of the 8 steps
  // of a cycle, which no later step mends.
  void ExpectSettled(double product) {
    const double b = kGlow / (1 - product);
    const double rounding = 2 * 8 * cycles_ * std::ldexp(1.0, -24) * kWalls *
                            kGrey * static_cast<double>(gain_) * most_sent_;
    const double off = (kUnsentW + rounding) / (1 - product);
    EXPECT_NEAR(balance_->Sum().leaving, kWalls * b, off);
    EXPECT_LE(balance_->Sum().unsent, kUnsentW + rounding);
    for (size_t i = 0; i < tree_->Size(); ++i) {
      const auto sent = tree_->Sent()[ElementId(i)];
      for (size_t k = 0; k < sent.size(); ++k) {
        EXPECT_NEAR(sent[k], b, off);
        EXPECT_EQ((*delta_)[ElementId(i)][k],
                  sent[k] - static_cast<float>(kGlow))
            << "others know of what was emitted";
      }
    }
  }

  const Basis basis_{2};
  test::RowOfRooms row_{1, GlowingGrey()};
  const SurfaceTable surfaces_ = MakeSurfaceTable(row_.scene);
  MemoryBudget budget_{kRoomy};
  const OcclusionDevice device_{budget_, Point3{}};
  std::unique_ptr<CellPager> pager_;
  std::shared_ptr<const CellGeometry> geometry_;
  std::shared_ptr<CellTree> tree_;
  std::shared_ptr<CoefficientArray> delta_;
  std::shared_ptr<ReceivedLight> received_;
  float gain_ = 0;
  CellRow cell_row_;
  SolveTimes times_;
  std::unique_ptr<CellBalance> balance_;
  int cycles_ = 0;
  double most_sent_ = 0;  // W/m2
};

TEST_F(SelfLinkedRoom, SettlesAtTheSeriesOfItsReflections) {
  StartWith(0.8, 0.95);
  Settle();
  EXPECT_EQ(cell_row_.hold, 0U);
  ExpectSettled(kGrey * static_cast<double>(gain_));
}

// Light that fades more slowly than the radius r says teaches it another. After
// k steps a component of eigenvalue l is T_k(l / r) / T_k(1 / r) of itself, T_k
// being Chebyshev's polynomials. Of the falls of steps 2 to 7 together, from
// which l is learnt as if they were the last ones of many, that leaves out a
// factor of (1.072 / 1.092)^(1 / 6) per step for r = 0.5 and l = 0.9: 0.3 % of
// the fall, and 0.25 % of l.
TEST_F(SelfLinkedRoom, LearnsHowSlowlyLightFades) {
  StartWith(0.9, 0.5);
  EXPECT_FALSE(RunCycle());
  EXPECT_GT(cell_row_.radius, 0.5);
  EXPECT_EQ(cell_row_.hold, 0U);
  const double learnt = cell_row_.radius;
  Settle();
  EXPECT_NEAR(learnt, kGrey * static_cast<double>(gain_), 0.005);
  ExpectSettled(kGrey * static_cast<double>(gain_));
}

// A product of 1.3 makes light grow whatever the radius. The radius falls
// first; then the gains are held: at 1.5, which is no help, at 1.2, which is
// none either, and at (1 + rho) / 2.
TEST_F(SelfLinkedRoom, WhereLightGrowsTheRadiusFallsBeforeGainsAreHeld) {
  StartWith(1.3, 0.95);
  EXPECT_FALSE(RunCycle());
  EXPECT_EQ(cell_row_.radius, 0.5);
  EXPECT_DOUBLE_EQ(cell_row_.most_radius, 0.8 * 0.95);
  EXPECT_EQ(cell_row_.hold, 0U);
  for (const HoldLevel level : {1U, 2U, kFirmHold}) {
    EXPECT_FALSE(RunCycle());
    EXPECT_EQ(cell_row_.radius, 0.5);
    EXPECT_EQ(cell_row_.most_radius, 1);
    EXPECT_EQ(cell_row_.hold, level);
  }
  Settle();
  EXPECT_EQ(cell_row_.hold, kFirmHold);
  ExpectSettled(0.5 * (1 + kGrey));
}

// The limit of the radius, once light has grown above it, holds.
TEST_F(SelfLinkedRoom, TheRadiusStaysBelowWhereLightGrew) {
  cell_row_.most_radius = 0.7;
  StartWith(0.9, 0.5);
  EXPECT_FALSE(RunCycle());
  EXPECT_EQ(cell_row_.radius, 0.7);
}

}  // namespace
}  // namespace enfilade
