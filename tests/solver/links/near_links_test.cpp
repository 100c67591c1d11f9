// Links of close elements: what the store keeps of a link suffices to rebuild
// the light that it brings.

#include "solver/elements/element_tree.h"
#include "solver/links/link_codes.h"
#include "solver/refine/refiner.h"
#include "solver/transfer/form_factor.h"

#include <array>
#include <cmath>
#include <numeric>
#include <utility>
#include <vector>

#include "tests/solver/test_refinement.h"
#include <gtest/gtest.h>

namespace enfilade {
namespace {

using test::BrightCell;
using test::FurnishedRoom;
using test::Scenery;

constexpr double kRoomTau = 0.01;

// What the receiver's nodes get from a source of 1 W/m2.
using Gain = std::array<float, kTransferNodes>;

// A furnished room that is linked to itself.
class LinkedRoom : public ::testing::Test {
 protected:
  LinkedRoom() {
    const RefineOptions options = {.tau = kRoomTau, .tau_weak = kRoomTau / 2};
    for (RawLinks& item : test::RefineAll(
             options, cell_.Receiver(), cell_.Source(), scenery_.All())) {
      items_.push_back(std::move(item));
    }
  }

  template <typename Check>
  size_t ForEach(LinkKind kind, const Check& check) const {
    size_t count = 0;
    for (const RawLinks& item : items_) {
      for (const RawLink& link : item.links) {
        if (link.kind == kind) {
          check(link, item);
          ++count;
        }
      }
    }
    return count;
  }

  [[nodiscard]] TransferEnd End(uint32_t patch, ElementPath path) const {
    const PatchGeometry& geometry = cell_.Geometry()[patch];
    return MakeTransferEnd(geometry, FrameOfPath(geometry.shape, path));
  }

  // The gain by the quadrature of the visible node pairs, scaled to the stored
  // sum.
  [[nodiscard]] Gain Rebuilt(const RawLink& link) const {
    Kernel kernel =
        QuadratureKernel(End(link.receiver_patch, link.receiver_path),
                         End(link.source_patch, link.source_path));
    MaskKernel(static_cast<uint16_t>(link.more), &kernel);
    const float total = std::accumulate(kernel.begin(), kernel.end(), 0.0F);
    Gain gain{};
    for (size_t i = 0; i < kernel.size(); ++i) {
      gain[i / kTransferNodes] +=
          kernel[i] / total * DecodeCoefficient(link.value);
    }
    return gain;
  }

  // The difference between the link's gain and `gain` in units of tau, weighed
  // as refinement weighs errors.
  [[nodiscard]] double Difference(const RawLink& link, const Gain& gain) const {
    double square = 0;
    for (size_t g = 0; g < kTransferNodes; ++g) {
      const double off = static_cast<double>(gain[g] - link.gain[g]);
      square += off * off / kTransferNodes;
    }
    const TransferEnd end = End(link.receiver_patch, link.receiver_path);
    return test::kReflectance * std::sqrt(end.area * square) / kRoomTau;
  }

  static double SumOf(const Gain& gain) {
    return std::accumulate(gain.begin(), gain.end(), 0.0);
  }

  const Basis basis_{2};
  const std::vector<Patch> room_ = FurnishedRoom();
  const BrightCell cell_{0, basis_, room_};
  const Scenery scenery_{room_};
  std::vector<RawLinks> items_;
};

TEST_F(LinkedRoom, NearAndShapedLinksKeepTheirSum) {
  const auto check = [](const RawLink& link, const RawLinks& /*item*/) {
    const double sum = SumOf(link.gain);
    EXPECT_NEAR(DecodeCoefficient(link.value), sum, 1e-3 * sum);
  };
  EXPECT_GT(ForEach(LinkKind::kNear, check), 100U);
  EXPECT_GT(ForEach(LinkKind::kShaped, check), 100U);
}

// The sources are even here, so the errors of rows are the whole error.
TEST_F(LinkedRoom, NearLinksAreRebuiltWhereThatIsNotSeen) {
  ForEach(LinkKind::kNear, [&](const RawLink& link, const RawLinks& /*item*/) {
    const Gain rebuilt = Rebuilt(link);
    EXPECT_GT(SumOf(rebuilt), 0);
    EXPECT_LE(Difference(link, rebuilt), 1.01 / 32);
  });
}

// A code of roots in 255ths puts a row off by half a step of its smallest
// coefficient and of the common scale, far less than a rebuilt link may be off.
TEST_F(LinkedRoom, ShapedLinksBringWhatTheirCodesSay) {
  ForEach(LinkKind::kShaped, [&](const RawLink& link, const RawLinks& item) {
    const KernelColumns columns =
        DecodeKernel(link.value, item.shapes.at(link.more));
    Gain coded{};
    for (const auto& column : columns) {
      for (size_t g = 0; g < kTransferNodes; ++g) {
        coded[g] += column[g];
      }
    }
    for (size_t g = 0; g < kTransferNodes; ++g) {
      EXPECT_NEAR(coded[g], link.gain[g], 0.005 * SumOf(link.gain));
    }
  });
}

}  // namespace
}  // namespace enfilade
