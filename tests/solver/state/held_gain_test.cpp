// The share that leaves keep of the gains that their links claim.

#include "solver/state/held_gain.h"

#include <cmath>

#include "tests/solver/test_cells.h"
#include "tests/visibility/test_rooms.h"
#include <gtest/gtest.h>

namespace enfilade {
namespace {

using test::GeometryOf;
using test::kFloatRounding;
using test::RandomPatches;

constexpr double kWhiteReflectance = 0.9;
constexpr HoldLevel kAllLevels[] = {0, 1, 2, kFirmHold, kFirmHold + 2};

float MostReflected(HoldLevel level) {
  const float all[] = {1e30F, 1.5F, 1.2F, 0.95F, 0.95F * 0.7F, 0.95F * 0.49F};
  return all[level];
}

class HeldGain : public ::testing::TestWithParam<size_t> {
 protected:
  HeldGain()
      : basis_(GetParam()),
        patches_(GeometryOf(RandomPatches(44, 3, 3, 1), kWhiteReflectance)),
        tree_({&basis_, kRgbChannels}, patches_),
        gain_(tree_.Shape().NodeStride()) {
    gain_.GrowTo(tree_.Size());
  }

  void SetGain(ElementId e, float gain) {
    for (float& g : gain_[e]) {
      g = gain;
    }
  }

  Basis basis_;
  std::vector<PatchGeometry> patches_;
  CellTree tree_;
  CoefficientArray gain_;
};

TEST_P(HeldGain, NoProductExceedsThatOfItsLevel) {
  for (const float gain : {0.5F, 1.0F, 1.1F, 1.3F, 1.6F, 3.0F, 100.0F}) {
    for (size_t i = 0; i < tree_.Size(); ++i) {
      SetGain(ElementId(i), gain);
    }
    for (const HoldLevel level : kAllLevels) {
      const float claimed = static_cast<float>(kWhiteReflectance) * gain;
      const CoefficientArray shares = HeldShares(tree_, gain_, patches_, level);
      ASSERT_EQ(shares.Size(), level == 0 ? 0 : tree_.Size());
      for (size_t i = 0; i < shares.Size(); ++i) {
        for (const float share : shares[ElementId(i)]) {
          EXPECT_NEAR(share * claimed,
                      std::min(claimed, MostReflected(level)),
                      kFloatRounding * claimed);
        }
      }
    }
  }
}

TEST_P(HeldGain, OfALeafIsTheSumOverItsAncestors) {
  const ElementPath path = ChildPath(ChildPath(kRootPath, 2), 1);
  const ElementId leaf = tree_.FindOrCreate(PatchId(0U), path, patches_);
  gain_.GrowTo(tree_.Size());
  for (size_t i = 0; i < tree_.Size(); ++i) {
    SetGain(ElementId(i), 0.6F);
  }
  const CoefficientArray shares = HeldShares(tree_, gain_, patches_, kFirmHold);
  const size_t nodes = basis_.On(patches_[0].shape).NodeCount();
  for (size_t q = 0; q < nodes; ++q) {
    EXPECT_NEAR(shares[leaf][q], 0.95 / (0.9 * 1.8), kFloatRounding);
  }
  for (const float share : shares[ElementId(1U)]) {
    EXPECT_EQ(share, 1) << "a root without children claims 0.54";
  }
}

TEST_P(HeldGain, NodesAreHeldOneByOne) {
  const auto gain = gain_[ElementId(0U)];
  for (size_t q = 0; q < gain.size(); ++q) {
    gain[q] = q == 0 ? 2.0F : 0.5F;
  }
  const CoefficientArray shares = HeldShares(tree_, gain_, patches_, kFirmHold);
  const auto own = shares[ElementId(0U)];
  for (size_t q = 0; q < own.size(); ++q) {
    EXPECT_NEAR(own[q], q == 0 ? 0.95 / (0.9 * 2) : 1, kFloatRounding);
  }
}

INSTANTIATE_TEST_SUITE_P(Orders, HeldGain, ::testing::Values(1, 2));

}  // namespace
}  // namespace enfilade
