// The gather of blocks of some ten thousand links of all kinds, which several
// threads share.

#include "base/parallel.h"
#include "base/random.h"
#include "solver/links/gather.h"
#include "solver/links/link_codes.h"
#include "solver/transfer/source_group.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "tests/solver/test_bulbs.h"
#include "tests/solver/test_cells.h"
#include "tests/visibility/test_rooms.h"
#include <gtest/gtest.h>

namespace enfilade {
namespace {

constexpr size_t kLinks = 10'000;
// Each of them gets hundreds of links, and some of these in the middle of the
// block, where the work is cut.
constexpr uint32_t kReceivers = 12;

std::vector<PatchGeometry> RoomWithABulb() {
  std::vector<Patch> patches = test::BoxPatches(test::kRoom, true);
  test::Append(patches, test::RandomPatches(5, 20, 3, 0.5));
  test::Append(patches, test::Bulb({2, 2, 2}, 0.05, 4));
  return test::GeometryOf(patches);
}

// A room that is linked to itself, with a basis of each order that links are
// made for in a way of its own: constant, second order, nodes of its own.
class ManyLinks : public ::testing::TestWithParam<size_t> {
 protected:
  ManyLinks()
      : basis_(GetParam()),
        patches_(RoomWithABulb()),
        groups_(patches_),
        tree_({&basis_, kRgbChannels}, patches_) {
    for (uint32_t patch = 0; patch < 6; ++patch) {
      tree_.FindOrCreate(PatchId(patch), ChildPath(kRootPath, 3), patches_);
    }
    for (size_t i = 0; i < tree_.Size(); ++i) {
      for (float& b : tree_.Sent()[ElementId(i)]) {
        b = static_cast<float>(2 * random_.Next() - 1);
      }
    }
  }

  // A basis of one node has no kernels, one with nodes of its own no groups.
  LinkKind RandomKind() {
    if (basis_.HasOwnNodes()) {
      return random_.NextBelow(2) == 0 ? LinkKind::kWeak : LinkKind::kFar;
    }
    if (basis_.kind.order == 1) {
      return random_.NextBelow(2) == 0 ? LinkKind::kWeak : LinkKind::kGroup;
    }
    return static_cast<LinkKind>(random_.NextBelow(5));
  }

  void AppendRandomLink(LinkBlock* block) {
    Link link;
    link.receiver = random_.NextBelow(kReceivers);
    link.source = random_.NextBelow(static_cast<uint32_t>(tree_.Size()));
    link.kind = RandomKind();
    link.value = EncodeCoefficient(static_cast<float>(random_.Next()));
    link.more = random_.NextBelow(1U << 16);
    if (link.kind == LinkKind::kShaped) {
      link.more = static_cast<uint32_t>(block->shapes.size());
      for (uint8_t& root : block->shapes.emplace_back()) {
        root = static_cast<uint8_t>(random_.NextBelow(256));
      }
    } else if (link.kind == LinkKind::kGroup) {
      link.source =
          random_.NextBelow(static_cast<uint32_t>(groups_.All().size()));
      link.more = static_cast<uint32_t>(block->group.size());
      for (uint16_t& coefficient : block->group.emplace_back()) {
        coefficient = EncodeCoefficient(static_cast<float>(random_.Next()));
      }
    }
    block->links.push_back(link);
  }

  LinkBlock RandomLinks() {
    LinkBlock block;
    for (size_t i = 0; i < kLinks; ++i) {
      AppendRandomLink(&block);
    }
    SortLinks(&block);
    return block;
  }

  void GatherTo(const LinkBlock& block, CoefficientArray* gathered) const {
    Gather(block,
           {patches_, &tree_, nullptr},
           {patches_, &tree_, &groups_},
           tree_.Sent(),
           *gathered);
  }

  [[nodiscard]] CoefficientArray Nothing() const {
    CoefficientArray gathered(tree_.Shape().Stride());
    gathered.GrowTo(tree_.Size());
    return gathered;
  }

  Random random_{2024};
  Basis basis_;
  std::vector<PatchGeometry> patches_;
  SourceGroups groups_;
  CellTree tree_;
};

TEST_P(ManyLinks, BringTheSameBitsForEveryNumberOfThreads) {
  const LinkBlock block = RandomLinks();
  std::vector<float> bits;
  for (const size_t threads : {size_t{1}, size_t{2}, size_t{7}}) {
    const ThreadLimit limit(threads);
    // The threads take other turns each time, if there is time for turns.
    for (int i = 0; i < (basis_.HasOwnNodes() ? 6 : 30); ++i) {
      CoefficientArray gathered = Nothing();
      GatherTo(block, &gathered);
      const auto values = gathered.Page(0);
      if (bits.empty()) {
        bits.assign(values.begin(), values.end());
      }
      EXPECT_TRUE(std::equal(bits.begin(), bits.end(), values.begin()))
          << threads << " threads";
    }
  }
  EXPECT_NE(bits, std::vector<float>(bits.size()));
}

// Adding n terms one by one, each addition rounded to the nearest, is off by at
// most (n - 1) u / (1 - (n - 1) u) times the sum of their sizes, u = 2^-24
// (Higham 2002, "Accuracy and stability of numerical algorithms", 4.2). The
// terms themselves are those of links gathered alone.
TEST_P(ManyLinks, BringTheSumOfEachAlone) {
  const LinkBlock block = RandomLinks();
  CoefficientArray gathered = Nothing();
  GatherTo(block, &gathered);
  CoefficientArray alone = Nothing();
  const size_t stride = alone.Stride();
  std::vector<double> sums(kReceivers * stride);
  std::vector<double> sizes(kReceivers * stride);
  std::vector<double> terms(kReceivers);
  for (size_t i = 0; i < block.links.size(); ++i) {
    LinkBlock one;
    one.AppendFrom(block, i);
    const uint32_t receiver = one.links[0].receiver;
    GatherTo(one, &alone);
    const auto values = alone[ElementId(receiver)];
    for (size_t k = 0; k < stride; ++k) {
      const auto value = static_cast<double>(values[k]);
      sums[receiver * stride + k] += value;
      sizes[receiver * stride + k] += std::abs(value);
      values[k] = 0;
    }
    ++terms[receiver];
  }
  EXPECT_EQ(alone.MaxAbs(), 0) << "a link brings light to its receiver only";
  for (uint32_t receiver = 0; receiver < kReceivers; ++receiver) {
    const double most = (terms[receiver] - 1) * std::ldexp(1.0, -24);
    for (size_t k = 0; k < stride; ++k) {
      const size_t at = receiver * stride + k;
      EXPECT_NEAR(gathered[ElementId(receiver)][k],
                  sums[at],
                  most / (1 - most) * sizes[at])
          << "receiver " << receiver << ", coefficient " << k;
    }
  }
  for (size_t i = kReceivers; i < tree_.Size(); ++i) {
    for (const float h : gathered[ElementId(i)]) {
      EXPECT_EQ(h, 0);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Orders, ManyLinks, ::testing::Values(1, 2, 3));

// The kinds of link that a constant basis has as well.
class LinksOfLowOrders : public ManyLinks {};

// The coefficient of a node times the mean of the group's patches; each product
// and mean of the few dozen patches is off by some 2^-24 of its size.
TEST_P(LinksOfLowOrders, GroupBringsTheMeanOfItsPatches) {
  ASSERT_FALSE(groups_.All().empty());
  const ElementId receiver(3U);
  for (uint32_t g = 0; g < groups_.All().size(); ++g) {
    GroupCoefficients codes{};
    for (uint16_t& code : codes) {
      code = EncodeCoefficient(static_cast<float>(random_.Next()));
    }
    LinkBlock block;
    block.links = {{receiver.value, g, LinkKind::kGroup, 0, 0}};
    block.group = {codes};
    CoefficientArray gathered = Nothing();
    GatherTo(block, &gathered);
    const auto h = gathered[receiver];
    const size_t stride = tree_.Shape().NodeStride();
    for (size_t c = 0; c < kRgbChannels; ++c) {
      double flux = 0;
      for (const uint32_t patch : groups_.PatchesOf(groups_.All()[g])) {
        const ShapeBasis& basis = basis_.On(patches_[patch].shape);
        for (size_t q = 0; q < basis.NodeCount(); ++q) {
          const float b = tree_.Sent()[ElementId(patch)][c * stride + q];
          flux += basis.Weight(q) * static_cast<double>(patches_[patch].area) *
                  static_cast<double>(b);
        }
      }
      const double mean = flux / static_cast<double>(groups_.All()[g].area);
      for (size_t q = 0; q < stride; ++q) {
        EXPECT_NEAR(h[c * stride + q],
                    static_cast<double>(DecodeCoefficient(codes[q])) * mean,
                    test::kFloatRounding);
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Orders, LinksOfLowOrders, ::testing::Values(1, 2));

class LinksOfAConstantBasis : public ManyLinks {};

TEST_P(LinksOfAConstantBasis, WeakBringsTheOnlyValue) {
  const ElementId receiver(2U);
  for (uint32_t source = 0; source < tree_.Size(); ++source) {
    const uint16_t code = EncodeCoefficient(static_cast<float>(random_.Next()));
    LinkBlock block;
    block.links = {{receiver.value, source, LinkKind::kWeak, code, 0}};
    CoefficientArray gathered = Nothing();
    GatherTo(block, &gathered);
    for (size_t c = 0; c < kRgbChannels; ++c) {
      EXPECT_EQ(gathered[receiver][c],
                DecodeCoefficient(code) * tree_.Sent()[ElementId(source)][c]);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Haar, LinksOfAConstantBasis, ::testing::Values(1));

}  // namespace
}  // namespace enfilade
