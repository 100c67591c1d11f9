// The parts of an item cover it once, in order, however deep they are cut.

#include "solver/state/work_part.h"

#include "base/random.h"

#include <vector>

#include <gtest/gtest.h>

namespace enfilade {
namespace {

// The places that a part holds of the 8 x 16 places of an item, two levels
// below its receivers.
std::vector<int> PlacesOf(const WorkPart& part) {
  std::vector<int> places;
  for (uint32_t r = 0; r < kItemReceivers; ++r) {
    for (int path = 0; path < 16; ++path) {
      const bool is_receiver = r >= part.FirstReceiver() &&
                               r < part.FirstReceiver() + part.ReceiverCount();
      bool is_below = true;
      for (uint32_t level = 0; level < part.Levels(); ++level) {
        is_below =
            is_below && part.ChildAt(level) ==
                            static_cast<size_t>(path >> (2 - 2 * level) & 3);
      }
      if (is_receiver && is_below) {
        places.push_back(static_cast<int>(r) * 16 + path);
      }
    }
  }
  return places;
}

TEST(WorkPart, PartsFollowEachOtherWithoutGapsOrOverlap) {
  Random random(5);
  for (int trial = 0; trial < 50; ++trial) {
    std::vector<int> seen;
    WorkPart part;
    while (part.item == 0) {
      if (part.depth < 3 && random.Next() < 0.6) {
        part = part.Narrowed();
        continue;
      }
      for (const int place : PlacesOf(part)) {
        seen.push_back(place);
      }
      part = part.Next();
    }
    EXPECT_EQ(part, (WorkPart{1, 0, 0}));
    ASSERT_EQ(seen.size(), kItemReceivers * 16);
    for (size_t i = 0; i < seen.size(); ++i) {
      EXPECT_EQ(seen[i], static_cast<int>(i));
    }
  }
}

TEST(WorkPart, LinksAboveItsElementBelongToTheFirstOne) {
  WorkPart whole;
  EXPECT_TRUE(whole.Owns(0));
  EXPECT_TRUE(whole.Owns(5));
  WorkPart part = {0, 3, 0};
  int owners = 0;
  for (; part.FirstReceiver() == 0 && part.item == 0; ++part.part) {
    owners += part.Owns(0) ? 1 : 0;
    EXPECT_TRUE(part.Owns(2));
    EXPECT_EQ(part.Owns(1), part.part % 4 == 0);
  }
  EXPECT_EQ(owners, 1);
}

TEST(WorkPart, MeetsItsReceiversAndEntersTheChildrenOnItsPath) {
  const WorkPart whole;
  EXPECT_TRUE(whole.Meets(5, 1));
  EXPECT_TRUE(whole.Enters(0, 3));
  // Of receiver 5, child 2 of its child 1.
  const WorkPart part = {0, 3, 5 << 4 | 1 << 2 | 2};
  EXPECT_TRUE(part.Meets(5, 1));
  EXPECT_TRUE(part.Meets(0, 6));
  EXPECT_FALSE(part.Meets(0, 5));
  EXPECT_FALSE(part.Meets(6, 2));
  for (size_t child = 0; child < 4; ++child) {
    EXPECT_EQ(part.Enters(0, child), child == 1);
    EXPECT_EQ(part.Enters(1, child), child == 2);
    EXPECT_TRUE(part.Enters(2, child));
  }
}

}  // namespace
}  // namespace enfilade
