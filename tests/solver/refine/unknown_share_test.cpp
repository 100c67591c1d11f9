// What rays leave unknown: the more they disagree, and the fewer they are.

#include "solver/refine/unknown_share.h"

#include <gtest/gtest.h>

namespace enfilade {
namespace {

TEST(UnknownShare, IsLargestWhereHalfOfTheRaysGetThrough) {
  EXPECT_FLOAT_EQ(MixedShare(0.5F), 0.25F);
  EXPECT_EQ(MixedShare(0), 0);
  EXPECT_EQ(MixedShare(1), 0);
  for (const float p : {0.0F, 0.0625F, 0.25F, 0.75F, 0.9375F, 1.0F}) {
    EXPECT_LT(UnknownShare(p, false, 0), UnknownShare(0.5F, false, 0)) << p;
  }
}

TEST(UnknownShare, IsMoreAfterFourRaysThanAfterSixteen) {
  EXPECT_GT(UnknownShare(0, true, 0), UnknownShare(0, false, 0));
  EXPECT_GT(UnknownShare(1, true, 0), UnknownShare(1, false, 0));
}

TEST(UnknownShare, FallsToAQuarterWithEachSplitOfABlockedTransfer) {
  for (const bool few : {false, true}) {
    for (int blocked = 0; blocked < 5; ++blocked) {
      EXPECT_EQ(UnknownBlocked(few, blocked + 1),
                UnknownBlocked(few, blocked) / 4);
      EXPECT_EQ(UnknownShare(0, few, blocked), UnknownBlocked(few, blocked));
    }
  }
}

TEST(UnknownShare, OfLightThatArrivesKnowsNothingOfBlockedSplits) {
  EXPECT_EQ(UnknownShare(1, false, 3), kUnprovenClear);
  EXPECT_EQ(UnknownShare(0.5F, false, 3), UnknownShare(0.5F, false, 0));
}

TEST(FewDecide, OnlyWhereLittleIsAtStake) {
  constexpr float kTau = 0.01F;
  EXPECT_TRUE(FewDecide(kTau, 0, kTau));
  EXPECT_FALSE(FewDecide(2 * kTau, 0, kTau));
  EXPECT_TRUE(FewDecide(2 * kTau, 1, kTau));
  EXPECT_FALSE(FewDecide(8 * kTau, 1, kTau));
}

}  // namespace
}  // namespace enfilade
