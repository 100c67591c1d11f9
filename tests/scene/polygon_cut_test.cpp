#include "scene/polygon_cut.h"

#include "base/random.h"

#include <cmath>

#include <gtest/gtest.h>

namespace enfilade {
namespace {

constexpr double kCutTolerance = 1e-9;

double TotalArea(const std::vector<Polygon2>& pieces) {
  double area = 0;
  for (const Polygon2& piece : pieces) {
    area += SignedArea(piece);
  }
  return area;
}

std::vector<Edge2> Rectangle(double x0, double y0, double x1, double y1) {
  std::vector<Edge2> edges;
  AppendEdges(Polygon2{{x0, y0}, {x1, y0}, {x1, y1}, {x0, y1}}, false, edges);
  return edges;
}

// The border of a random union of unit cells of a grid, with holes.
struct RandomCells {
  static constexpr int kSide = 9;

  explicit RandomCells(uint64_t seed) {
    Random random(seed);
    for (auto& row : filled) {
      for (bool& cell : row) {
        cell = random.Next() < 0.6;
        area += cell ? 1 : 0;
      }
    }
  }

  [[nodiscard]] bool At(int x, int y) const {
    return x >= 0 && y >= 0 && x < kSide && y < kSide && filled[y][x];
  }

  // Directed border edges, turned by an angle.
  [[nodiscard]] std::vector<Edge2> Border(double angle) const {
    std::vector<Edge2> edges;
    const auto add = [&](int x0, int y0, int x1, int y1) {
      const auto turn = [&](double x, double y) {
        return Point2{x * std::cos(angle) - y * std::sin(angle),
                      x * std::sin(angle) + y * std::cos(angle)};
      };
      edges.push_back({turn(x0, y0), turn(x1, y1)});
    };
    for (int y = 0; y <= kSide; ++y) {
      for (int x = 0; x <= kSide; ++x) {
        if (At(x, y) && !At(x, y - 1)) {
          add(x, y, x + 1, y);
        } else if (!At(x, y) && At(x, y - 1)) {
          add(x + 1, y, x, y);
        }
        if (At(x, y) && !At(x - 1, y)) {
          add(x, y + 1, x, y);
        } else if (!At(x, y) && At(x - 1, y)) {
          add(x, y, x, y + 1);
        }
      }
    }
    return edges;
  }

  bool filled[kSide][kSide] = {};
  double area = 0;
};

bool Overlap(const Polygon2& a, const Polygon2& b) {
  // Tests the sides of both convex polygons as separating axes.
  const auto separates = [](const Polygon2& p, const Polygon2& q) {
    for (size_t i = 0; i < p.size(); ++i) {
      const Point2 s = p[i];
      const Point2 t = p[(i + 1) % p.size()];
      bool outside = true;
      for (const Point2 r : q) {
        outside = outside &&
                  (t.x - s.x) * (r.y - s.y) - (t.y - s.y) * (r.x - s.x) <= 1e-7;
      }
      if (outside) {
        return true;
      }
    }
    return false;
  };
  return !separates(a, b) && !separates(b, a);
}

TEST(PolygonCut, RectangleStaysOnePiece) {
  const auto pieces = CutRegion(Rectangle(1, 2, 4, 3), kCutTolerance);
  ASSERT_EQ(pieces.size(), 1U);
  EXPECT_EQ(SignedArea(pieces[0]), 3.0);
}

TEST(PolygonCut, WallWithADoorOnItsLowerEdgeIsThreeRectangles) {
  std::vector<Edge2> edges = Rectangle(0, 0, 5, 3);
  AppendEdges(
      Polygon2{{2, 0}, {3, 0}, {3, 2}, {2, 2}}, /*reversed=*/true, edges);
  const auto pieces = CutRegion(edges, kCutTolerance);
  EXPECT_EQ(pieces.size(), 3U);
  EXPECT_NEAR(TotalArea(pieces), 13, 1e-12);
}

TEST(PolygonCut, HoleThatReachesBeyondItsWallIsClipped) {
  std::vector<Edge2> edges = Rectangle(0, 0, 5, 3);
  AppendEdges(
      Polygon2{{2, -1}, {3, -1}, {3, 2}, {2, 2}}, /*reversed=*/true, edges);
  EXPECT_NEAR(TotalArea(CutRegion(edges, kCutTolerance)), 13, 1e-12);
}

TEST(PolygonCut, ThresholdTwoIsTheIntersection) {
  std::vector<Edge2> edges = Rectangle(0, 0, 3, 3);
  AppendEdges(Polygon2{{2, -1}, {5, 2}, {2, 5}}, false, edges);
  // The triangle has all of the square's strip from x = 2 to x = 3.
  EXPECT_NEAR(TotalArea(CutRegion(edges, kCutTolerance, 2)), 3, 1e-12);
}

TEST(PolygonCut, GableIsCutWithoutLoss) {
  std::vector<Edge2> edges;
  AppendEdges(Polygon2{{0, 0}, {4, 0}, {4, 2}, {2, 4}, {0, 2}}, false, edges);
  AppendEdges(Polygon2{{1, 1}, {2, 1}, {2, 2.5}, {1, 2.5}}, true, edges);
  EXPECT_NEAR(TotalArea(CutRegion(edges, kCutTolerance)), 12 - 1.5, 1e-12);
}

TEST(PolygonCut, RandomRegionsAreCoveredExactlyAndWithoutOverlap) {
  for (uint64_t seed = 0; seed < 40; ++seed) {
    const RandomCells cells(seed);
    const double angle = seed % 2 == 0 ? 0.0 : 0.37;
    const auto pieces = CutRegion(cells.Border(angle), kCutTolerance);
    EXPECT_NEAR(TotalArea(pieces), cells.area, 1e-9 * cells.area)
        << "seed " << seed;
    if (angle == 0.0) {
      EXPECT_LT(static_cast<double>(pieces.size()), cells.area);
    }
    for (size_t i = 0; i < pieces.size(); ++i) {
      EXPECT_TRUE(IsConvex(pieces[i], kCutTolerance)) << "seed " << seed;
      for (size_t j = 0; j < i; ++j) {
        ASSERT_FALSE(Overlap(pieces[i], pieces[j])) << "seed " << seed;
      }
    }
  }
}

TEST(PlaneFrame, PointsOfAxisParallelPlanesComeBackExactly) {
  const PlaneFrame frame =
      MakePlaneFrame({0.1, 0.2, 2.7}, {0, 0, -3}, {0.3, 0, 0});
  const Point3 p{0.1234567, -9.87, 2.7};
  EXPECT_EQ(frame.To3(frame.To2(p)), p);
}

TEST(PatchCost, CountsPatches) {
  EXPECT_EQ(PatchCost(Polygon2{{0, 0}, {1, 0}, {0, 1}}, kCutTolerance), 1U);
  EXPECT_EQ(PatchCost(Polygon2{{0, 0}, {1, 0}, {2, 1}, {1, 1}}, kCutTolerance),
            1U);
  EXPECT_EQ(PatchCost(Polygon2{{0, 0}, {3, 0}, {2, 1}, {1, 1}}, kCutTolerance),
            2U);
}

}  // namespace
}  // namespace enfilade
