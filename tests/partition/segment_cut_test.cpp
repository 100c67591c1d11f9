// Polygons are cut along segments, as far as the segments run inside.

#include "partition/segment_cut.h"

#include "base/photometry.h"
#include "base/random.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "tests/partition/test_scenes.h"
#include <gtest/gtest.h>

namespace enfilade {
namespace {

using testing::kUp;

constexpr size_t kMany = 1000;

const Polygon kFloor{{0, 0, 0}, {4, 0, 0}, {4, 3, 0}, {0, 3, 0}};

double AreaOf(const std::vector<Polygon>& polygons) {
  double area = 0;
  for (const Polygon& p : polygons) {
    area += PolygonArea(p);
  }
  return area;
}

// The depth, m, of a point inside a polygon that faces up; negative outside.
double DepthIn(const Polygon& polygon, Point3 p) {
  double depth = 1e9;
  for (size_t i = 0; i < polygon.size(); ++i) {
    const Vec3 edge = polygon[(i + 1) % polygon.size()] - polygon[i];
    depth = std::min(depth, Dot(Normalize(Cross(kUp, edge)), p - polygon[i]));
  }
  return depth;
}

std::vector<Segment> RimOf(double x, double y, double width, double height) {
  const Point3 a{x, y, 0};
  const Point3 b{x + width, y, 0};
  const Point3 c{x + width, y + height, 0};
  const Point3 d{x, y + height, 0};
  return {{a, b}, {b, c}, {c, d}, {d, a}};
}

TEST(SegmentCut, NothingIsCutByNothing) {
  const auto parts = CutAlongSegments(kFloor, kUp, {}, kMany);
  ASSERT_EQ(parts.size(), 1U);
  EXPECT_EQ(parts[0], kFloor);
}

TEST(SegmentCut, ARectangleInsideLeavesFourPartsAround) {
  const auto parts =
      CutAlongSegments(kFloor, kUp, {RimOf(1.5, 1, 1, 0.7), {}}, kMany);
  EXPECT_EQ(parts.size(), 5U);
  EXPECT_NEAR(AreaOf(parts), 12, 1e-12);
  EXPECT_EQ(std::count_if(parts.begin(),
                          parts.end(),
                          [](const Polygon& p) {
                            return std::abs(PolygonArea(p) - 0.7) < 1e-12;
                          }),
            1);
}

TEST(SegmentCut, ACutIsMadeOnceHoweverOftenItIsAskedFor) {
  std::vector<Segment> rim = RimOf(1, 1, 1, 0.5);
  const std::vector<Segment> again = rim;
  rim.insert(rim.end(), again.begin(), again.end());
  EXPECT_EQ(CutAlongSegments(kFloor, kUp, {rim, {}}, kMany).size(), 5U);
}

TEST(SegmentCut, WhatDoesNotRunInsideDoesNotCut) {
  const std::vector<Segment> outside = {
      {{0, 0, 0}, {4, 0, 0}},          // the polygon's own edge
      {{0, 5e-4, 0}, {4, 5e-4, 0}},    // as good as that
      {{5, 1, 0}, {6, 2, 0}},          // beside it
      {{3.99, 2, 0}, {5, 2, 0}},       // runs in by a centimetre
      {{-1, 1.5, 0}, {-0.1, 1.5, 0}},  // only its extension would cut
  };
  EXPECT_EQ(CutAlongSegments(kFloor, kUp, {outside, {}}, kMany).size(), 1U);
}

TEST(SegmentCut, StopsAtTheMostParts) {
  std::vector<Segment> many;
  for (int i = 1; i < 40; ++i) {
    many.push_back({{0.1 * i, 0, 0}, {0.1 * i, 3, 0}});
  }
  EXPECT_EQ(CutAlongSegments(kFloor, kUp, {many, {}}, kMany).size(), 40U);
  const auto some = CutAlongSegments(kFloor, kUp, {many, {}}, 7);
  EXPECT_EQ(some.size(), 7U);
  EXPECT_NEAR(AreaOf(some), 12, 1e-9);
}

// A line that would cross a spared region waits until other lines have parted
// the two, however far the line runs.
TEST(SegmentCut, LinesGoAroundWhatIsToBeSpared) {
  std::vector<Segment> segments = RimOf(1, 1, 0.4, 0.4);
  segments.push_back({{0, 1.2, 0}, {4, 1.2, 0}});
  const Spared inside{{1.2, 1.2, 0}, 0.1, 1};
  const auto whole_parts = [&](const std::vector<Spared>& spared) {
    const auto parts = CutAlongSegments(kFloor, kUp, {segments, spared}, kMany);
    return std::count_if(parts.begin(), parts.end(), [&](const Polygon& p) {
      return DepthIn(p, inside.middle) > 0.19;
    });
  };
  EXPECT_EQ(whole_parts({}), 0);
  EXPECT_EQ(whole_parts({inside}), 0);  // cut at last: the line runs there
  segments.back() = {{2, 1.2, 0}, {4, 1.2, 0}};
  EXPECT_EQ(whole_parts({}), 0);
  EXPECT_EQ(whole_parts({inside}), 1);
}

// The length of a part over its width.
double ProportionOf(const Polygon& p) {
  const double length = Length(BoundsOf(p).Extent());
  return length * length / PolygonArea(p);
}

// A board that stands on a floor is cut out without a strip as narrow as the
// board across the whole of the floor.
TEST(SegmentCut, ABoardIsCutOutWithoutStrips) {
  const double width = 0.7;
  const double thickness = 0.03;
  const auto parts = CutAlongSegments(
      kFloor, kUp, {RimOf(1.5, 1, width, thickness), {}}, kMany);
  EXPECT_EQ(parts.size(), 5U);
  EXPECT_NEAR(AreaOf(parts), 12, 1e-12);
  size_t boards = 0;
  for (const Polygon& p : parts) {
    const bool is_board = PolygonArea(p) < 1.01 * width * thickness;
    boards += is_board ? 1U : 0U;
    EXPECT_TRUE(is_board || ProportionOf(p) < 8) << ProportionOf(p);
  }
  EXPECT_EQ(boards, 1U);
}

// The ends of a thin board run for less than least_run, and are no lines to cut
// along. The floor is cut across where its long sides end.
TEST(SegmentCut, ABoardTooThinForItsEndsIsCutOutAcross) {
  const auto parts =
      CutAlongSegments(kFloor, kUp, {RimOf(1.5, 1, 0.7, 0.02), {}}, kMany);
  EXPECT_EQ(parts.size(), 5U);
  EXPECT_NEAR(AreaOf(parts), 12, 1e-12);
  for (const Polygon& p : parts) {
    EXPECT_TRUE(PolygonArea(p) < 0.0141 || ProportionOf(p) < 8)
        << ProportionOf(p);
  }
}

// What runs along a strip as a whole, such as a skirting board, is cut off.
TEST(SegmentCut, AStripThatIsAllUsedIsCutOff) {
  const std::vector<Segment> skirting = {{{0, 0.02, 0}, {4, 0.02, 0}}};
  const auto parts = CutAlongSegments(kFloor, kUp, {skirting, {}}, kMany);
  ASSERT_EQ(parts.size(), 2U);
  EXPECT_NEAR(
      std::min(PolygonArea(parts[0]), PolygonArea(parts[1])), 4 * 0.02, 1e-12);
}

// The rule: the parts make up the polygon, and no segment runs through the
// inside of a part unless the cut would leave a part that is too narrow.
TEST(SegmentCut, NoSegmentRunsThroughAPart) {
  Random random(7);
  const auto draw = [&](double low, double high) {
    return low + (high - low) * random.Next();
  };
  size_t parts_seen = 0;
  for (int round = 0; round < 200; ++round) {
    SCOPED_TRACE(round);
    const Polygon polygon = {{0, 0, 0},
                             {draw(2, 4), draw(-0.5, 0.5), 0},
                             {draw(2, 3), draw(2, 3), 0},
                             {draw(-0.5, 0.5), draw(1, 2), 0}};
    std::vector<Segment> segments;
    for (int k = 0; k < 6; ++k) {
      segments.push_back(
          {{draw(-1, 4), draw(-1, 3), 0}, {draw(-1, 4), draw(-1, 3), 0}});
    }
    const auto parts = CutAlongSegments(polygon, kUp, {segments, {}}, kMany);
    parts_seen += parts.size();
    EXPECT_NEAR(AreaOf(parts), PolygonArea(polygon), 1e-9);
    for (const Polygon& part : parts) {
      for (const Segment& s : segments) {
        double deepest = 0;
        double inside = 0;
        for (int i = 0; i < 400; ++i) {
          const double depth = DepthIn(part, Lerp(s.a, s.b, (i + 0.5) / 400));
          deepest = std::max(deepest, depth);
          inside += depth > kNarrowPartM ? Length(s.b - s.a) / 400 : 0;
        }
        // A part this deep that the segment runs so far through could be
        // halved.
        EXPECT_FALSE(deepest > 0.01 && inside > kShortRunM + 0.02)
            << deepest << " " << inside;
      }
    }
  }
  EXPECT_GT(parts_seen, 1000U);
}

}  // namespace
}  // namespace enfilade
