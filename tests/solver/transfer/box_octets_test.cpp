#include "solver/transfer/box_octets.h"

#include "base/random.h"

#include <vector>

#include <gtest/gtest.h>

namespace enfilade {
namespace {

Box RandomBox(Random& random) {
  const auto point = [&] {
    return Vec3f{static_cast<float>(random.Next()),
                 static_cast<float>(random.Next()),
                 static_cast<float>(random.Next())};
  };
  const Vec3f low = point();
  return {low, low + point() * 0.1F};
}

std::vector<Box> RandomBoxes(size_t count, Random& random) {
  std::vector<Box> boxes;
  for (size_t i = 0; i < count; ++i) {
    boxes.push_back(RandomBox(random));
  }
  return boxes;
}

std::vector<bool> Visited(const BoxOctets& tree, size_t count, const Box& box) {
  std::vector<bool> visited(count);
  tree.VisitAll([&](const BoxOctet& boxes) { return boxes.Overlapping(box); },
                [&](size_t i) {
                  EXPECT_FALSE(visited.at(i));
                  visited.at(i) = true;
                  return true;
                });
  return visited;
}

// For any number of boxes, in full octets or not, the tree visits every
// overlapping box once.
TEST(BoxOctets, VisitWhatOverlaps) {
  Random random(7);
  for (const size_t count : std::vector<size_t>{0, 1, 7, 8, 9, 64, 65, 1000}) {
    const std::vector<Box> boxes = RandomBoxes(count, random);
    const BoxOctets tree(boxes);
    for (int i = 0; i < 50; ++i) {
      const Box box = RandomBox(random);
      const std::vector<bool> visited = Visited(tree, count, box);
      for (size_t k = 0; k < count; ++k) {
        EXPECT_EQ(visited[k], boxes[k].Overlaps(box));
      }
    }
    EXPECT_EQ(tree.SizeBytes(), BoxOctets::BytesFor(count));
  }
}

TEST(BoxOctets, StopWhenToldTo) {
  Random random(8);
  const BoxOctets tree(RandomBoxes(100, random));
  int visits = 0;
  EXPECT_FALSE(tree.VisitAll(
      [](const BoxOctet& boxes) {
        return boxes.Overlapping(Box::Everything());
      },
      [&](size_t) { return ++visits < 3; }));
  EXPECT_EQ(visits, 3);
}

// Boxes that touch, even at one corner, overlap.
TEST(BoxOctet, WhatTouchesOverlaps) {
  BoxOctet octet;
  octet.Set(5, {{0, 0, 0}, {1, 1, 1}});
  EXPECT_EQ(octet.Overlapping({{1, 1, 1}, {2, 2, 2}}), 1U << 5);
  EXPECT_EQ(octet.Overlapping({{1.1F, 0, 0}, {2, 1, 1}}), 0U);
  EXPECT_EQ(octet.Overlapping({{0, -1, 0}, {1, -0.1F, 1}}), 0U);
  EXPECT_EQ(octet.Overlapping({{-9, -9, -9}, {9, 9, 9}}), 1U << 5);
}

}  // namespace
}  // namespace enfilade
