// Links get ids, elements and gains.

#include "solver/refine/apply_links.h"

#include "solver/links/link_codes.h"

#include <cstddef>
#include <utility>
#include <vector>

#include "tests/solver/test_refinement.h"
#include "tests/visibility/test_rooms.h"
#include <gtest/gtest.h>

namespace enfilade {
namespace {

using test::BrightCell;

// Two squares that are linked with each other.
class TwoSquares : public ::testing::Test {
 protected:
  void Apply(std::vector<RawLink> links) {
    RawLinks part;
    part.links = std::move(links);
    cell_.Link(part, &block_);
  }

  const Basis basis_ = Basis(2);
  BrightCell cell_ = BrightCell(0, basis_, {test::Floor(), test::Ceiling(1)});
  LinkBlock block_;
};

TEST_F(TwoSquares, GetTheElementsThatLinksName) {
  RawLink link;
  link.source_patch = 1;
  link.receiver_path = ChildPath(kRootPath, 2);
  link.kind = LinkKind::kFar;
  link.more = 0xffff;
  link.gain = {0.125F, 0.25F, 0.5F, 1};
  Apply({link, link});
  EXPECT_EQ(cell_.Tree().Size(), 2 + kChildren);
  ASSERT_EQ(block_.links.size(), 2U);
  const Link& made = block_.links[1];
  EXPECT_EQ(made.receiver,
            cell_.Tree().At(ElementId(size_t{0})).first_child + 2);
  EXPECT_EQ(made.source, 1U);
  EXPECT_EQ(made.kind, LinkKind::kFar);
  EXPECT_EQ(made.more, 0xffffU);
  // Both links bring light.
  const float* gain = cell_.Received().gain.At(made.receiver);
  for (size_t g = 0; g < kTransferNodes; ++g) {
    EXPECT_EQ(gain[g], 2 * link.gain[g]);
  }
}

TEST_F(TwoSquares, HaveTheShapesOfAllParts) {
  RawLinks part;
  part.links.resize(2);
  part.shapes = {{1}, {2}};
  part.links[0].kind = LinkKind::kShaped;
  part.links[0].more = 1;
  part.links[1].kind = LinkKind::kShaped;
  part.links[1].more = 0;
  cell_.Link(part, &block_);
  cell_.Link(part, &block_);
  ASSERT_EQ(block_.links.size(), 4U);
  for (size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(block_.shapes[block_.links[i].more][0], i % 2 == 0 ? 2 : 1) << i;
  }
}

TEST_F(TwoSquares, KeepTheGainOfAGroup) {
  RawLink link;
  link.source_patch = 7;
  link.kind = LinkKind::kGroup;
  link.gain = {0.125F, 0.25F, 0.5F, 1};
  Apply({link});
  ASSERT_EQ(block_.links.size(), 1U);
  EXPECT_EQ(block_.links[0].source, 7U);
  const GroupCoefficients& kept = block_.group[block_.links[0].more];
  for (size_t g = 0; g < kTransferNodes; ++g) {
    EXPECT_EQ(DecodeCoefficient(kept[g]), link.gain[g]);
  }
}

}  // namespace
}  // namespace enfilade
