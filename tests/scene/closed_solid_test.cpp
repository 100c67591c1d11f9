// Which polygons enclose a solid, and on which side of them the solid lies.

#include "scene/closed_solid.h"

#include "base/photometry.h"
#include "scene/polygon_cut.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

namespace enfilade {
namespace {

constexpr double kBeside = 1e-4;

// Polygons over vertices that they share.
struct Mesh {
  std::vector<Point3> vertices;
  std::vector<VertexLoop> polygons;

  uint32_t Vertex(Point3 p) {
    const auto same = [p](Point3 q) { return Length(q - p) < 1e-9; };
    const auto it = std::find_if(vertices.begin(), vertices.end(), same);
    const auto at = static_cast<uint32_t>(it - vertices.begin());
    if (it == vertices.end()) {
      vertices.push_back(p);
    }
    return at;
  }

  void Add(const std::vector<Point3>& polygon) {
    VertexLoop loop;
    for (const Point3 p : polygon) {
      loop.push_back(Vertex(p));
    }
    polygons.push_back(loop);
  }

  // Adds a box whose faces look outwards.
  void AddBox(const Box3& box) {
    const Vec3 e = box.Extent();
    const auto at = [&](double x, double y, double z) {
      return box.low + Vec3{x * e.x, y * e.y, z * e.z};
    };
    Add({at(0, 0, 0), at(0, 1, 0), at(1, 1, 0), at(1, 0, 0)});
    Add({at(0, 0, 1), at(1, 0, 1), at(1, 1, 1), at(0, 1, 1)});
    Add({at(0, 0, 0), at(1, 0, 0), at(1, 0, 1), at(0, 0, 1)});
    Add({at(0, 1, 0), at(0, 1, 1), at(1, 1, 1), at(1, 1, 0)});
    Add({at(0, 0, 0), at(0, 0, 1), at(0, 1, 1), at(0, 1, 0)});
    Add({at(1, 0, 0), at(1, 1, 0), at(1, 1, 1), at(1, 0, 1)});
  }

  // Adds a prism of two polygons and the quadrilaterals between them, which
  // look outwards if the outline runs counter-clockwise.
  void AddPrism(const std::vector<Point2>& outline) {
    const auto at = [&](size_t i, double z) {
      const Point2 p = outline[i % outline.size()];
      return Point3{p.x, p.y, z};
    };
    std::vector<Point3> bottom;
    std::vector<Point3> top;
    for (size_t i = 0; i < outline.size(); ++i) {
      bottom.push_back(at(i, 0));
      top.push_back(at(i, 0.5));
      Add({at(i, 0), at(i + 1, 0), at(i + 1, 0.5), at(i, 0.5)});
    }
    std::reverse(bottom.begin(), bottom.end());
    Add(bottom);
    Add(top);
  }

  void TurnAll() {
    for (VertexLoop& loop : polygons) {
      std::reverse(loop.begin(), loop.end());
    }
  }

  [[nodiscard]] std::vector<std::optional<ClosedSolid>> Solids() const {
    auto solids = FindClosedSolids(vertices, polygons, kBeside).solids;
    EXPECT_EQ(solids.size(), polygons.size());
    return solids;
  }

  [[nodiscard]] size_t CountInSolids() const {
    const auto solids = Solids();
    return static_cast<size_t>(
        std::count_if(solids.begin(), solids.end(), [](const auto& solid) {
          return solid.has_value();
        }));
  }
};

constexpr Box3 kBoard{{1000, 2, 3}, {1001, 2.4, 3.02}};

Mesh Board() {
  Mesh mesh;
  mesh.AddBox(kBoard);
  return mesh;
}

TEST(ClosedSolid, BoardHasItsInsideBehindItsFaces) {
  for (const auto& solid : Board().Solids()) {
    ASSERT_TRUE(solid);
    EXPECT_FALSE(solid->front_is_inside);
    EXPECT_EQ(Length(solid->bounds.low - kBoard.low), 0);
    EXPECT_EQ(Length(solid->bounds.high - kBoard.high), 0);
  }
}

TEST(ClosedSolid, TurnedBoardHasItBeforeThem) {
  Mesh mesh = Board();
  mesh.TurnAll();
  for (const auto& solid : mesh.Solids()) {
    ASSERT_TRUE(solid);
    EXPECT_TRUE(solid->front_is_inside);
  }
}

TEST(ClosedSolid, OpenBoxIsNone) {
  Mesh mesh = Board();
  mesh.polygons.pop_back();
  EXPECT_EQ(mesh.CountInSolids(), 0U);
}

TEST(ClosedSolid, FacesMayBeWoundAnyhow) {
  Mesh mesh = Board();
  for (const size_t i : {2U, 5U}) {
    std::reverse(mesh.polygons[i].begin(), mesh.polygons[i].end());
  }
  const auto solids = mesh.Solids();
  for (size_t i = 0; i < solids.size(); ++i) {
    ASSERT_TRUE(solids[i]);
    EXPECT_EQ(solids[i]->front_is_inside, i == 2 || i == 5);
  }
}

TEST(ClosedSolid, BoxWithACrackAlongAnEdgeIsNone) {
  Mesh mesh = Board();
  // One face ends a little short of the corner.
  mesh.polygons[3][1] =
      mesh.Vertex(mesh.vertices[mesh.polygons[3][1]] + Vec3{0, 0, -0.001});
  EXPECT_EQ(mesh.CountInSolids(), 0U);
}

TEST(ClosedSolid, BoxesThatTouchAlongAnEdgeAreTwo) {
  Mesh mesh;
  mesh.AddBox({{0, 0, 0}, {1, 1, 1}});
  mesh.AddBox({{1, 1, 0}, {2, 2, 1}});
  EXPECT_EQ(mesh.CountInSolids(), 12U);
  EXPECT_LT(mesh.Solids()[0]->bounds.high.x, 1.5);
}

TEST(ClosedSolid, SolidBesideAnOpenSheetIsFoundAlone) {
  Mesh mesh = Board();
  mesh.Add({{0, 0, 0}, {1, 0, 0}, {1, 1, 0}});
  EXPECT_EQ(mesh.CountInSolids(), 6U);
  EXPECT_FALSE(mesh.Solids().back());
}

std::vector<Point2> Star(size_t tips) {
  std::vector<Point2> outline;
  for (size_t i = 0; i < 2 * tips; ++i) {
    const double angle =
        kPi * static_cast<double>(i) / static_cast<double>(tips);
    const double radius = i % 2 == 0 ? 2 : 0.4;
    outline.push_back({radius * std::cos(angle), radius * std::sin(angle)});
  }
  return outline;
}

// A path 0.2 wide that winds inwards, of right angles.
std::vector<Point2> Spiral() {
  std::vector<Point2> outer = {{0, 0}, {5, 0}, {5, 5}, {0, 5}, {0, 1}};
  for (const Point2 p : {Point2{4, 1}, {4, 4}, {1, 4}, {1, 2}, {3, 2}}) {
    outer.push_back(p);
  }
  const std::vector<Point2> back = {{3, 2.2},
                                    {1.2, 2.2},
                                    {1.2, 3.8},
                                    {3.8, 3.8},
                                    {3.8, 1.2},
                                    {0.2, 1.2},
                                    {0.2, 4.8},
                                    {4.8, 4.8},
                                    {4.8, 0.2},
                                    {0, 0.2}};
  outer.insert(outer.end(), back.begin(), back.end());
  return outer;
}

// The middle of a triangle of three successive corners may lie in a notch.
TEST(ClosedSolid, PrismsOverConcavePolygonsAreSolids) {
  const std::vector<std::vector<Point2>> outlines = {
      {{0, 0}, {4, 0}, {4, 1}, {1, 1}, {1, 4}, {0, 4}},
      {{0, 0}, {3, 0}, {3, 4}, {2, 4}, {2, 1}, {1, 1}, {1, 4}, {0, 4}},
      {{0, 0}, {9, 0}, {9, 9}, {8.9, 9}, {8.9, 0.1}, {0, 0.1}},
      Star(5),
      Star(8),
      Spiral()};
  for (size_t k = 0; k < outlines.size(); ++k) {
    for (const bool turned : {false, true}) {
      std::vector<Point2> outline = outlines[k];
      if (turned) {
        std::reverse(outline.begin(), outline.end());
      }
      for (size_t first = 0; first < outline.size(); ++first) {
        Mesh mesh;
        mesh.AddPrism(outline);
        for (const auto& solid : mesh.Solids()) {
          ASSERT_TRUE(solid) << k << " from corner " << first;
          EXPECT_EQ(solid->front_is_inside, turned);
        }
        std::rotate(outline.begin(), outline.begin() + 1, outline.end());
      }
    }
  }
}

// A prism over a bow tie: by the winding of its faces, one half is inside and
// the other half is outside.
TEST(ClosedSolid, PrismThatCrossesItselfIsNone) {
  Mesh mesh;
  const auto at = [](double x, double y, double z) { return Point3{x, y, z}; };
  // The two halves meet along the line x = y = 0.
  mesh.Add({at(0, 0, 0), at(1, 0, 0), at(1, 0, 1), at(0, 0, 1)});
  mesh.Add({at(1, 0, 0), at(0, 1, 0), at(0, 1, 1), at(1, 0, 1)});
  mesh.Add({at(0, 1, 0), at(0, -1, 0), at(0, -1, 1), at(0, 1, 1)});
  mesh.Add({at(0, -1, 0), at(-1, 0, 0), at(-1, 0, 1), at(0, -1, 1)});
  mesh.Add({at(-1, 0, 0), at(0, 0, 0), at(0, 0, 1), at(-1, 0, 1)});
  mesh.Add({at(0, 0, 0), at(0, 1, 0), at(1, 0, 0)});
  mesh.Add({at(0, 0, 1), at(1, 0, 1), at(0, 1, 1)});
  mesh.Add({at(0, 0, 0), at(-1, 0, 0), at(0, -1, 0)});
  mesh.Add({at(0, 0, 1), at(0, -1, 1), at(-1, 0, 1)});
  EXPECT_EQ(mesh.CountInSolids(), 0U);
}

// A slab whose top slopes down to `thickness` at one end.
Mesh TaperedSlab(double thickness) {
  Mesh mesh;
  const auto at = [&](int x, int y, int z) {
    const double high = x == 0 ? 0.12 : thickness;
    return Point3{2.0 * x, 1.0 * y, z == 0 ? 0 : high};
  };
  mesh.Add({at(0, 0, 0), at(0, 1, 0), at(1, 1, 0), at(1, 0, 0)});
  mesh.Add({at(0, 0, 1), at(1, 0, 1), at(1, 1, 1), at(0, 1, 1)});
  mesh.Add({at(0, 0, 0), at(1, 0, 0), at(1, 0, 1), at(0, 0, 1)});
  mesh.Add({at(0, 1, 0), at(0, 1, 1), at(1, 1, 1), at(1, 1, 0)});
  mesh.Add({at(0, 0, 0), at(0, 0, 1), at(0, 1, 1), at(0, 1, 0)});
  mesh.Add({at(1, 0, 0), at(1, 1, 0), at(1, 1, 1), at(1, 0, 1)});
  return mesh;
}

// Where the top lies below the bottom, both look to the outside.
TEST(ClosedSolid, SlabWhoseTopGoesThroughItsBottomIsNone) {
  EXPECT_EQ(TaperedSlab(0.01).CountInSolids(), 6U);
  for (const double below : {-0.01, -0.05, -0.12, -0.3}) {
    EXPECT_EQ(TaperedSlab(below).CountInSolids(), 0U) << below;
  }
}

// Near its edge a wedge is thinner than the distance of the points that tell
// its inside.
TEST(ClosedSolid, WedgeIsOne) {
  Mesh mesh;
  const auto at = [](double x, double y, double z) { return Point3{x, y, z}; };
  mesh.Add({at(0, 0, 0), at(0, 1, 0), at(2, 1, 0), at(2, 0, 0)});
  mesh.Add({at(0, 0, 0.01), at(2, 0, 0), at(2, 1, 0), at(0, 1, 0.01)});
  mesh.Add({at(0, 0, 0), at(0, 0, 0.01), at(0, 1, 0.01), at(0, 1, 0)});
  mesh.Add({at(0, 0, 0), at(2, 0, 0), at(0, 0, 0.01)});
  mesh.Add({at(0, 1, 0), at(0, 1, 0.01), at(2, 1, 0)});
  EXPECT_EQ(mesh.CountInSolids(), 5U);
}

}  // namespace
}  // namespace enfilade
