#include "solver/links/link_block.h"

#include "base/random.h"

#include <cmath>
#include <cstddef>
#include <cstdint>

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
    link.kind = static_cast<LinkKind>(random.NextBelow(5));
    if (link.kind != LinkKind::kGroup && link.kind != LinkKind::kFar) {
      link.value = static_cast<uint16_t>(random.NextBelow(65536));
    }
    if (link.kind == LinkKind::kShaped) {
      link.more = static_cast<uint32_t>(block.shapes.size());
      KernelShape n{};
      n[i % n.size()] = static_cast<uint8_t>(random.NextBelow(256));
      block.shapes.push_back(n);
    } else if (link.kind == LinkKind::kGroup) {
      link.source = random.NextBelow(30);
      link.more = static_cast<uint32_t>(block.group.size());
      GroupCoefficients g{};
      g[i % g.size()] = static_cast<uint16_t>(random.NextBelow(65536));
      block.group.push_back(g);
    } else if (link.kind != LinkKind::kWeak) {
      link.more = random.NextBelow(65536);  // visibility
    }
    block.links.push_back(link);
  }
  SortLinks(&block);
  return block;
}

TEST(LinkBlock, SurvivesEncoding) {
  const LinkBlock block = RandomBlock(2000, 1);
  const LinkBlock read = DecodeLinks(EncodeLinks(block), {500, 700, 30});
  ASSERT_EQ(read.links.size(), block.links.size());
  ASSERT_EQ(read.shapes, block.shapes);
  ASSERT_EQ(read.group, block.group);
  for (size_t i = 0; i < block.links.size(); ++i) {
    EXPECT_EQ(read.links[i].receiver, block.links[i].receiver);
    EXPECT_EQ(read.links[i].source, block.links[i].source);
    EXPECT_EQ(read.links[i].kind, block.links[i].kind);
    EXPECT_EQ(read.links[i].value, block.links[i].value);
    EXPECT_EQ(read.links[i].more, block.links[i].more);
  }
}

// Whatever the order, a link keeps the coefficients that it came with.
TEST(LinkBlock, KeepsCoefficientsWithTheirLinks) {
  LinkBlock block;
  for (uint32_t i = 0; i < 40; ++i) {
    Link link;
    link.receiver = (i * 17) % 40;
    link.kind = i % 2 == 0 ? LinkKind::kShaped : LinkKind::kGroup;
    link.more = i / 2;
    const auto tag = static_cast<uint8_t>(link.receiver);
    if (i % 2 == 0) {
      block.shapes.push_back({tag});
    } else {
      block.group.push_back({tag});
    }
    block.links.push_back(link);
  }
  SortLinks(&block);
  LinkBlock half;
  for (size_t i = 20; i < 40; ++i) {
    half.AppendFrom(block, i);
  }
  for (const LinkBlock* b : {&block, &half}) {
    for (const Link& link : b->links) {
      EXPECT_EQ(link.kind == LinkKind::kShaped ? b->shapes[link.more][0]
                                               : b->group[link.more][0],
                link.receiver);
    }
  }
}

TEST(LinkBlock, EveryTruncationIsNamedAsDamage) {
  const Bytes bytes = EncodeLinks(RandomBlock(40, 2));
  for (size_t size = 0; size < bytes.size(); ++size) {
    EXPECT_THROW(DecodeLinks(std::span(bytes).first(size), {500, 700, 30}),
                 DamagedStoreError)
        << size;
  }
}

TEST(LinkBlock, ElementsThatAreNotThereAreNamedAsDamage) {
  const Bytes bytes = EncodeLinks(RandomBlock(400, 3));
  EXPECT_THROW(DecodeLinks(bytes, {100, 700, 30}), DamagedStoreError);
  EXPECT_THROW(DecodeLinks(bytes, {500, 100, 30}), DamagedStoreError);
  EXPECT_THROW(DecodeLinks(bytes, {500, 700, 10}), DamagedStoreError);
}

// A block begins with its number of links; the kind of the first is in the
// lowest three bits of the byte that follows.
TEST(LinkBlock, KindsThatThereAreNotAreNamedAsDamage) {
  LinkBlock block;
  block.links = {{3, 5, LinkKind::kWeak, 7, 0}};
  const Bytes whole = EncodeLinks(block);
  ASSERT_EQ(DecodeLinks(whole, {500, 700, 30}).links.size(), 1U);
  for (uint8_t kind = 5; kind < 8; ++kind) {
    Bytes bytes = whole;
    bytes[1] |= std::byte{kind};
    EXPECT_THROW(DecodeLinks(bytes, {500, 700, 30}), DamagedStoreError)
        << "kind " << int{kind};
  }
}

}  // namespace
}  // namespace enfilade
