#include "solver/link_block.h"

#include "base/random.h"

#include <cmath>

#include <gtest/gtest.h>

namespace enfilade {
namespace {

LinkBlock RandomBlock(size_t count, uint64_t seed) {
  Random random(seed);
  LinkBlock block;
  for (size_t i = 0; i < count; ++i) {
    Link link;
    link.receiver = random.NextBelow(500);
    link.source = random.NextBelow(700);
    link.kind = static_cast<LinkKind>(random.NextBelow(3));
    if (link.kind == LinkKind::kNear) {
      link.near_index = static_cast<uint32_t>(block.near.size());
      NearCoefficients n{};
      n[i % n.size()] = static_cast<uint16_t>(random.NextBelow(65536));
      block.near.push_back(n);
    } else {
      link.value = static_cast<uint16_t>(random.NextBelow(65536));
    }
    block.links.push_back(link);
  }
  SortLinks(&block);
  return block;
}

TEST(Coefficient, KeepsElevenBits) {
  for (float v = 1e-9F; v < 1e4F; v *= 1.37F) {
    EXPECT_NEAR(
        DecodeCoefficient(EncodeCoefficient(v)) / v, 1.0, std::ldexp(1.0, -11));
  }
  EXPECT_EQ(DecodeCoefficient(EncodeCoefficient(0)), 0.0F);
  EXPECT_EQ(DecodeCoefficient(EncodeCoefficient(-1)), 0.0F);
}

TEST(LinkBlock, SurvivesEncoding) {
  const LinkBlock block = RandomBlock(2000, 1);
  const LinkBlock read = DecodeLinks(EncodeLinks(block), 500, 700);
  ASSERT_EQ(read.links.size(), block.links.size());
  ASSERT_EQ(read.near, block.near);
  for (size_t i = 0; i < block.links.size(); ++i) {
    EXPECT_EQ(read.links[i].receiver, block.links[i].receiver);
    EXPECT_EQ(read.links[i].source, block.links[i].source);
    EXPECT_EQ(read.links[i].kind, block.links[i].kind);
    EXPECT_EQ(read.links[i].value, block.links[i].value);
    EXPECT_EQ(read.links[i].near_index, block.links[i].near_index);
  }
}

TEST(LinkBlock, EveryTruncationIsNamedAsDamage) {
  const Bytes bytes = EncodeLinks(RandomBlock(40, 2));
  for (size_t size = 0; size < bytes.size(); ++size) {
    EXPECT_THROW(DecodeLinks(std::span(bytes).first(size), 500, 700),
                 DamagedStoreError)
        << size;
  }
}

TEST(LinkBlock, ElementsThatAreNotThereAreNamedAsDamage) {
  const Bytes bytes = EncodeLinks(RandomBlock(400, 3));
  EXPECT_THROW(DecodeLinks(bytes, 100, 700), DamagedStoreError);
  EXPECT_THROW(DecodeLinks(bytes, 500, 100), DamagedStoreError);
}

}  // namespace
}  // namespace enfilade
