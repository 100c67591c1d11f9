// The hull of two boxes holds every segment between them, and leaves out what
// lies beside the diagonal.

#include "solver/transfer/box_hull.h"

#include "base/random.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <gtest/gtest.h>

namespace enfilade {
namespace {

float Between(Random& random, float low, float high) {
  return low + static_cast<float>(random.Next()) * (high - low);
}

Vec3f PointIn(const Box& box, Random& random) {
  return {Between(random, box.low.x, box.high.x),
          Between(random, box.low.y, box.high.y),
          Between(random, box.low.z, box.high.z)};
}

// A box within 10 m of `center`, flat along each axis in a third of all cases,
// as the boxes of elements are.
Box SomeBox(Vec3f center, Random& random) {
  const auto extent = [&] {
    return random.NextBelow(3) == 0 ? 0.0F : Between(random, 0, 3);
  };
  Box box;
  box.Add(center + Vec3f{Between(random, -7, 7),
                         Between(random, -7, 7),
                         Between(random, -7, 7)});
  box.Add(box.low + Vec3f{extent(), extent(), extent()});
  return box;
}

Box PointBox(Vec3f p) {
  return {p, p};
}

// A box of up to 3 m somewhere around `p`.
Box BoxWith(Vec3f p, Random& random) {
  const auto apart = [&] {
    return Vec3f{Between(random, 0, 1.5F),
                 Between(random, 0, 1.5F),
                 Between(random, 0, 1.5F)};
  };
  return {p - apart(), p + apart()};
}

TEST(BoxHull, HoldsAllSegmentsBetweenTheBoxes) {
  Random random(1);
  // Far from the origin coordinates are rounded to a 16,000th of a metre.
  for (const float away : {0.0F, 1000.0F}) {
    for (int i = 0; i < 2000; ++i) {
      const Vec3f center = {away, -away, away};
      const Box a = SomeBox(center, random);
      const Box b = SomeBox(center, random);
      const BoxHull hull(a, b);
      for (int k = 0; k < 20; ++k) {
        const Vec3f p = PointIn(a, random);
        const Vec3f q = PointIn(b, random);
        // The ends of a segment are where rounding could do most harm.
        for (const float t : {0.0F, 1.0F, Between(random, 0, 1)}) {
          Vec3f on = p + (q - p) * t;
          if (t == 1) {
            on = q;
          }
          EXPECT_TRUE(hull.Overlaps(PointBox(on))) << i << ", " << k;
          EXPECT_TRUE(hull.Overlaps(BoxWith(on, random))) << i << ", " << k;
        }
      }
    }
  }
}

// A point is outside exactly if a plane along an axis separates it from both
// boxes. Seen along that axis, a direction of which both rectangles and the
// point fall on different sides is then found among many.
TEST(BoxHull, LeavesOutWhatPlanesAlongAnAxisSeparate) {
  Random random(2);
  int separated = 0;
  for (int i = 0; i < 3000; ++i) {
    const Box a = SomeBox({}, random);
    const Box b = SomeBox({}, random);
    const BoxHull hull(a, b);
    const Vec3f p = PointIn(hull.Bounds(), random);
    const auto is_beyond = [&](size_t x, size_t y, float angle) {
      const float nx = std::cos(angle);
      const float ny = std::sin(angle);
      const auto farthest = [&](const Box& box) {
        return nx * (nx > 0 ? box.high[x] : box.low[x]) +
               ny * (ny > 0 ? box.high[y] : box.low[y]);
      };
      // A margin far above rounding.
      return nx * p[x] + ny * p[y] > std::max(farthest(a), farthest(b)) + 1e-3F;
    };
    bool beyond = false;
    constexpr int kAngles = 720;
    for (int k = 0; k < kAngles && !beyond; ++k) {
      const float angle = 6.2831853F * static_cast<float>(k) / kAngles;
      beyond = is_beyond(0, 1, angle) || is_beyond(1, 2, angle) ||
               is_beyond(2, 0, angle);
    }
    separated += beyond ? 1 : 0;
    EXPECT_TRUE(!beyond || !hull.Overlaps(PointBox(p))) << i;
  }
  EXPECT_GT(separated, 500);
}

TEST(BoxHull, TellsEightBoxesApartAsItDoesOne) {
  Random random(3);
  int within = 0;
  int outside = 0;
  for (int i = 0; i < 3000; ++i) {
    const BoxHull hull(SomeBox({}, random), SomeBox({}, random));
    std::array<Box, BoxOctet::kCount> boxes;
    BoxOctet octet;
    for (size_t k = 0; k < boxes.size(); ++k) {
      boxes[k] = SomeBox({}, random);
      octet.Set(k, boxes[k]);
    }
    const uint32_t bits = hull.Overlapping(octet);
    for (size_t k = 0; k < boxes.size(); ++k) {
      const bool overlaps = hull.Overlaps(boxes[k]);
      EXPECT_EQ((bits >> k & 1) != 0, overlaps);
      (overlaps ? within : outside) += 1;
    }
  }
  EXPECT_GT(within, 100);
  EXPECT_GT(outside, 100);
}

TEST(BoxHull, OfOneBoxIsThatBox) {
  const Box box = {{1, 2, 3}, {2, 4, 6}};
  const BoxHull hull(box, box);
  EXPECT_TRUE(hull.Overlaps(PointBox({2, 4, 6})));
  EXPECT_FALSE(hull.Overlaps(PointBox({2.01F, 4, 6})));
}

}  // namespace
}  // namespace enfilade
