// How often weak transfers are kept.

#include "solver/refine/weak_draw.h"

#include <cmath>
#include <cstdint>

#include "tests/solver/test_refinement.h"
#include "tests/visibility/test_rooms.h"
#include <gtest/gtest.h>

namespace enfilade {
namespace {

using test::BrightCell;
using test::Scenery;

constexpr double kTauWeak = 2;
constexpr uint64_t kDraws = 100000;

class WeakDraws : public ::testing::Test {
 protected:
  // The share of the transfers with these bounds that are kept.
  [[nodiscard]] double ShareOfKept(const WeakBounds& bounds) const {
    double kept = 0;
    for (uint64_t key = 0; key < kDraws; ++key) {
      kept += WeakDraw(pair_, bounds, key).IsKept() ? 1 : 0;
    }
    return kept / static_cast<double>(kDraws);
  }

  // Four standard deviations of the share, if its mean is `probability`.
  static double Tolerance(double probability) {
    return 4 * std::sqrt(probability * (1 - probability) /
                         static_cast<double>(kDraws));
  }

  const Basis basis_ = Basis(2);
  const BrightCell floor_ = BrightCell(0, basis_, {test::Floor()});
  const BrightCell ceiling_ = BrightCell(1, basis_, {test::Ceiling(1)});
  const Scenery none_ = Scenery({});
  const test::SourceAndTree source_ = ceiling_.Source();
  const PairContext pair_ = {
      PairWork({.tau_weak = kTauWeak}, floor_.Receiver(), source_),
      *source_.tree,
      none_.All()};
};

TEST_F(WeakDraws, KeepTheShareOfTheBoundInTauWeak) {
  const WeakBounds bounds = {.brightness = 6, .form_factor = 0.1F};
  EXPECT_FLOAT_EQ(WeakDraw(pair_, bounds, 0).Probability(), 0.3F);
  EXPECT_NEAR(ShareOfKept(bounds), 0.3, Tolerance(0.3));
}

// What is dark now may be lit later: coefficients stay at most 1.
TEST_F(WeakDraws, KeepDarkSourcesByTheirFormFactor) {
  const WeakBounds bounds = {.brightness = 0, .form_factor = 0.1F};
  EXPECT_FLOAT_EQ(WeakDraw(pair_, bounds, 0).Probability(), 0.1F);
  EXPECT_NEAR(ShareOfKept(bounds), 0.1, Tolerance(0.1));
}

// A pair that was chosen with a probability is kept with the rest of what it
// needs; one that needs more is kept whenever it was chosen.
TEST_F(WeakDraws, TakeIntoAccountHowThePairWasChosen) {
  const WeakBounds rare = {.brightness = 6, .form_factor = 0.1F, .drawn = 0.5F};
  EXPECT_FLOAT_EQ(WeakDraw(pair_, rare, 0).Probability(), 0.3F);
  EXPECT_NEAR(ShareOfKept(rare), 0.6, Tolerance(0.6));
  const WeakBounds frequent = {
      .brightness = 6, .form_factor = 0.1F, .drawn = 0.2F};
  EXPECT_EQ(WeakDraw(pair_, frequent, 0).Probability(), 0.2F);
  EXPECT_EQ(ShareOfKept(frequent), 1);
}

// So that all together are right on the average.
TEST_F(WeakDraws, DivideWhatTheyCarryByTheProbability) {
  const ReceiverElement r = RootReceiver(floor_.Receiver(), {0, kRootPath});
  RawLinks out;
  LinkSink sink(none_.All(), {}, &out);
  const WeakDraw draw(pair_, {.brightness = 6, .form_factor = 0.1F}, 0);
  const SampledTransfer sample{0.06F, {{0.5F, 0.5F, 0}, {0.5F, 0.5F, 1}}};
  draw.Add({}, r, sample, &sink);
  draw.Add({}, r, {}, &sink);  // of which nothing arrives
  sink.Finish();
  ASSERT_EQ(out.links.size(), 1U);
  EXPECT_FLOAT_EQ(out.links[0].gain[0], 0.2F);
  // The deviation of what is kept from what is meant, for the brightest source.
  const double error = 6 * 0.2 * std::sqrt(1 - 0.3);
  EXPECT_NEAR(out.squared_error, error * error, 1e-5);
}

}  // namespace
}  // namespace enfilade
