// Display meshes follow the rules that define them: balanced, anchored, exact
// for polynomials of the basis, with the integral of the leaves.

#include "solver/solution/display_mesh.h"

#include "base/error.h"
#include "partition/polygon.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "tests/solver/test_cells.h"
#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>
#include <gtest/gtest.h>

namespace enfilade {
namespace {

using test::GeometryOf;

constexpr uint64_t kBudgetBytes = 64ULL << 20;

// Axes of a plane that is parallel to no axis.
const Vec3 kX = Normalize({2, 1, 0.5});
const Vec3 kNormal = Normalize(Cross(kX, {0.1, 0.2, 1}));
const Vec3 kY = Cross(kNormal, kX);
const Point3 kOrigin{3, -2, 1};

Point3 At(double x, double y) {
  return kOrigin + kX * x + kY * y;
}

PlanePoint Flat(Point3 p) {
  return {Dot(p - kOrigin, kX), Dot(p - kOrigin, kY)};
}

Patch MakePatch(PlanePoint origin,
                PlanePoint u,
                PlanePoint v,
                PatchShape shape = PatchShape::kParallelogram) {
  Patch p;
  p.origin = At(origin.x, origin.y);
  p.u = kX * u.x + kY * u.y;
  p.v = kX * v.x + kY * v.y;
  p.shape = shape;
  return p;
}

// A square of 2 x 2 m, three thirds of a strip beside it, two triangles above
// and a sliver below.
std::vector<Patch> Pavement() {
  constexpr double kThird = 2.0 / 3;
  const auto triangle = PatchShape::kTriangle;
  return {MakePatch({0, 0}, {2, 0}, {0, 2}),
          MakePatch({2, 0}, {1, 0}, {0, kThird}),
          MakePatch({2, kThird}, {1, 0}, {0, kThird}),
          MakePatch({2, 2 * kThird}, {1, 0}, {0, kThird}),
          MakePatch({0, 2}, {2, 0}, {0, 2}, triangle),
          MakePatch({2, 4}, {-2, 0}, {0, -2}, triangle),
          MakePatch({0, -0.05}, {2, 0}, {0, 0.05})};
}

// The outline of the pavement.
const std::vector<PlanePoint> kOutline = {
    {0, -0.05}, {2, -0.05}, {2, 0}, {3, 0}, {3, 2}, {2, 2}, {2, 4}, {0, 4}};

bool OnOutline(PlanePoint p) {
  for (size_t i = 0; i < kOutline.size(); ++i) {
    const PlanePoint a = kOutline[i];
    const PlanePoint along = kOutline[(i + 1) % kOutline.size()] - a;
    const PlanePoint from = p - a;
    const double t = (from.x * along.x + from.y * along.y) /
                     (along.x * along.x + along.y * along.y);
    if (std::abs(Cross(along, from)) < 1e-9 && t > -1e-9 && t < 1 + 1e-9) {
      return true;
    }
  }
  return false;
}

// The pavement under a random forest of a basis of the given order.
class DisplayMeshTest : public ::testing::TestWithParam<size_t> {
 protected:
  DisplayMeshTest()
      : basis_(GetParam()),
        patches_(Pavement()),
        geometry_(GeometryOf(patches_)),
        tree_({&basis_, kRgbChannels}, geometry_),
        gathered_(tree_.Shape().Stride()),
        cell_(patches_) {
    Random random(7);
    for (int i = 0; i < 25; ++i) {
      ElementPath path = kRootPath;
      for (uint32_t level = random.NextBelow(6); level > 0; --level) {
        path = ChildPath(path, random.NextBelow(kChildren));
      }
      const PatchId patch(
          random.NextBelow(static_cast<uint32_t>(patches_.size())));
      tree_.FindOrCreate(patch, path, geometry_);
    }
    // Refines one patch deeply in the corner where four patches meet.
    ElementPath path = kRootPath;
    for (int level = 0; level < 7; ++level) {
      path = ChildPath(path, 3);
    }
    tree_.FindOrCreate(PatchId(0U), path, geometry_);
    gathered_.GrowTo(tree_.Size());
  }

  void SetRandomCoefficients() {
    Random random(11);
    for (size_t e = 0; e < tree_.Size(); ++e) {
      for (float& x : gathered_[ElementId(e)]) {
        x = static_cast<float>(random.Next());
      }
    }
  }

  // Gives `field(x, y)` to the roots: coefficients are values at the nodes.
  template <typename Field>
  void SetField(const Field& field) {
    for (size_t p = 0; p < patches_.size(); ++p) {
      const Patch& patch = patches_[p];
      const ShapeBasis& on = basis_.On(patch.shape);
      for (size_t q = 0; q < on.NodeCount(); ++q) {
        const UnitPoint node = on.Node(q);
        const PlanePoint at =
            Flat(patch.origin + patch.u * node.a + patch.v * node.b);
        for (size_t c = 0; c < kRgbChannels; ++c) {
          gathered_[ElementId(p)][c * basis_.parallelogram.NodeCount() + q] =
              static_cast<float>(field(at));
        }
      }
    }
  }

  [[nodiscard]] DisplayMesh Mesh(bool smooth = true) {
    EXPECT_EQ(cell_.groups.size(), 1U);
    return DisplayMesh(tree_, gathered_, cell_, 0, {smooth}, budget_);
  }

  // The integral over the leaves, each of which has the sum of its ancestors'
  // means.
  [[nodiscard]] double IntegralOfLeaves() {
    double sum = 0;
    for (size_t e = 0; e < tree_.Size(); ++e) {
      const Element& element = tree_.At(ElementId(e));
      const Patch& patch = patches_[element.patch];
      const ShapeBasis& on = basis_.On(patch.shape);
      const auto scale = static_cast<double>(element.frame.scale);
      const double area = PatchArea(patch) * scale * scale;
      for (size_t q = 0; q < on.NodeCount(); ++q) {
        sum += area * on.Weight(q) *
               static_cast<double>(gathered_[ElementId(e)][q]);
      }
    }
    return sum;
  }

  static double IntegralOf(const DisplayMesh& mesh) {
    const std::vector<double> areas = mesh.VertexAreas();
    double sum = 0;
    for (size_t v = 0; v < mesh.VertexCount(); ++v) {
      sum += areas[v] * mesh.Irradiance(v)[0];
    }
    return sum;
  }

  Basis basis_;
  std::vector<Patch> patches_;
  std::vector<PatchGeometry> geometry_;
  CellTree tree_;
  CoefficientArray gathered_;
  CoplanarPatches cell_;
  MemoryBudget budget_{kBudgetBytes};
};

// Corners of a leaf, and whether they hold a point.
std::vector<PlanePoint> CornersOfLeaf(const DisplayForest& forest, size_t e) {
  std::vector<PlanePoint> corners;
  for (size_t k = 0; k < forest.CornerCount(e); ++k) {
    corners.push_back(forest.PointOn(e, UnitCorner(forest.ShapeOf(e), k)));
  }
  return corners;
}

bool Holds(const std::vector<PlanePoint>& corners, PlanePoint p) {
  for (size_t k = 0; k < corners.size(); ++k) {
    const PlanePoint a = corners[k];
    const PlanePoint along = corners[(k + 1) % corners.size()] - a;
    if (Cross(along, p - a) < -1e-9 * Length(along)) {
      return false;
    }
  }
  return true;
}

double LongestEdge(const std::vector<PlanePoint>& corners) {
  double longest = 0;
  for (size_t k = 0; k < corners.size(); ++k) {
    longest = std::max(longest,
                       Length(corners[(k + 1) % corners.size()] - corners[k]));
  }
  return longest;
}

TEST_P(DisplayMeshTest, TouchingLeavesAreBalanced) {
  const DisplayMesh mesh = Mesh();
  const DisplayForest& forest = mesh.Forest();
  std::vector<std::vector<PlanePoint>> leaves;
  for (size_t e = 0; e < forest.Size(); ++e) {
    if (forest.IsLeaf(e)) {
      leaves.push_back(CornersOfLeaf(forest, e));
    }
  }
  ASSERT_GT(leaves.size(), 100U);
  size_t touching = 0;
  for (const auto& a : leaves) {
    for (const auto& b : leaves) {
      if (std::any_of(
              a.begin(), a.end(), [&](PlanePoint p) { return Holds(b, p); })) {
        ++touching;
        ASSERT_LE(LongestEdge(a), 2.0001 * LongestEdge(b));
        ASSERT_LE(LongestEdge(b), 2.0001 * LongestEdge(a));
      }
    }
  }
  EXPECT_GT(touching, 5 * leaves.size());
}

// OpenMesh accepts only a manifold. The edges with one triangle are the
// outline, and nothing is missing.
TEST_P(DisplayMeshTest, HasNoTVertices) {
  using HalfEdgeMesh = OpenMesh::TriMesh_ArrayKernelT<>;
  const DisplayMesh mesh = Mesh();
  HalfEdgeMesh half_edges;
  std::vector<HalfEdgeMesh::VertexHandle> vertices;
  std::set<std::pair<int64_t, int64_t>> places;
  for (size_t v = 0; v < mesh.VertexCount(); ++v) {
    vertices.push_back(half_edges.add_vertex({0, 0, 0}));
    const PlanePoint p = Flat(mesh.Position(v));
    places.emplace(std::llround(p.x * 1e7), std::llround(p.y * 1e7));
  }
  EXPECT_EQ(places.size(), mesh.VertexCount());
  mesh.ForEachTriangle([&](const DisplayTriangle& t) {
    EXPECT_TRUE(half_edges
                    .add_face(vertices[t.vertices[0]],
                              vertices[t.vertices[1]],
                              vertices[t.vertices[2]])
                    .is_valid());
  });
  for (const auto edge : half_edges.edges()) {
    const auto place = [&](const HalfEdgeMesh::VertexHandle& v) {
      return Flat(mesh.Position(static_cast<size_t>(v.idx())));
    };
    const PlanePoint a = place(edge.v0());
    const PlanePoint b = place(edge.v1());
    EXPECT_EQ(half_edges.is_boundary(edge),
              OnOutline({(a.x + b.x) / 2, (a.y + b.y) / 2}));
  }
  double area = 0;
  for (const double share : mesh.VertexAreas()) {
    EXPECT_GT(share, 0);
    area += share;
  }
  EXPECT_NEAR(area, 4 + 2 + 4 + 0.1, 1e-9);
}

// Single precision holds each value to 1e-6 of the largest; the mesh adds up a
// few of them.
TEST_P(DisplayMeshTest, APolynomialOfTheBasisIsReproduced) {
  const auto degree = static_cast<double>(GetParam()) - 1;
  const auto field = [&](PlanePoint p) {
    return 2 + std::pow(0.7 * p.x - 0.4 * p.y + 1, degree);
  };
  SetField(field);
  const DisplayMesh mesh = Mesh();
  for (size_t v = 0; v < mesh.VertexCount(); ++v) {
    const double expected = field(Flat(mesh.Position(v)));
    for (const double value : mesh.Irradiance(v)) {
      ASSERT_NEAR(value, expected, 2e-5);
    }
  }
  if (GetParam() > 2) {
    return;  // linear between vertices
  }
  Random random(3);
  for (int i = 0; i < 1000; ++i) {
    const auto id = random.NextBelow(static_cast<uint32_t>(patches_.size()));
    const Patch& patch = patches_[id];
    UnitPoint p{random.Next(), random.Next()};
    if (patch.shape == PatchShape::kTriangle && p.a + p.b > 1) {
      p = {1 - p.a, 1 - p.b};
    }
    ASSERT_NEAR(mesh.IrradianceAt(PatchId(id), p)[0],
                field(Flat(patch.origin + patch.u * p.a + patch.v * p.b)),
                2e-5);
  }
}

TEST_P(DisplayMeshTest, SmoothingKeepsTheIntegral) {
  SetRandomCoefficients();
  const double smooth = IntegralOf(Mesh(true));
  EXPECT_NEAR(smooth, IntegralOf(Mesh(false)), 1e-5 * smooth);
  // A fan around the centre integrates bilinear functions exactly.
  if (GetParam() <= 2) {
    EXPECT_NEAR(smooth, IntegralOfLeaves(), 1e-5 * smooth);
  }
}

TEST_P(DisplayMeshTest, AnchoredLeavesKeepTheirOwnValues) {
  SetRandomCoefficients();
  const DisplayMesh mesh = Mesh(false);
  // Vertices are not shared between leaves, so constants stay constant.
  mesh.ForEachTriangle([&](const DisplayTriangle& t) {
    for (const uint32_t vertex : t.vertices) {
      if (GetParam() == 1) {
        EXPECT_EQ(mesh.Irradiance(vertex), mesh.Irradiance(t.vertices[0]));
      }
    }
  });
  EXPECT_GT(mesh.VertexCount(), 2 * Mesh().VertexCount());
}

TEST_P(DisplayMeshTest, ChargesAreGivenBackAndKept) {
  {
    const DisplayMesh mesh = Mesh();
    EXPECT_GT(budget_.UsedBytes(), mesh.VertexCount() * 28);
  }
  EXPECT_EQ(budget_.UsedBytes(), 0U);
  MemoryBudget small(10'000);
  EXPECT_THROW(DisplayMesh(tree_, gathered_, cell_, 0, {}, small),
               DoesNotFitError);
  EXPECT_EQ(small.UsedBytes(), 0U);
}

INSTANTIATE_TEST_SUITE_P(Orders, DisplayMeshTest, ::testing::Values(1, 2, 3));

CoefficientArray ZerosFor(const CellTree& tree) {
  CoefficientArray gathered(tree.Shape().Stride());
  gathered.GrowTo(tree.Size());
  return gathered;
}

// Two squares side by side, of constant irradiance 1 and 3, and what stands
// between them.
class DisplayBorderTest : public ::testing::Test {
 protected:
  std::set<double> ValuesWith(std::vector<Patch> more) {
    std::vector<Patch> patches = {MakePatch({0, 0}, {1, 0}, {0, 1}),
                                  MakePatch({1, 0}, {1, 0}, {0, 1})};
    patches.insert(patches.end(), more.begin(), more.end());
    const Basis haar(1);
    const auto geometry = GeometryOf(patches);
    CellTree tree({&haar, kRgbChannels}, geometry);
    CoefficientArray gathered = ZerosFor(tree);
    for (size_t c = 0; c < kRgbChannels; ++c) {
      gathered[ElementId(0U)][c] = 1;
      gathered[ElementId(1U)][c] = 3;
    }
    const CoplanarPatches cell(patches);
    const DisplayMesh mesh(tree, gathered, cell, 0, {}, budget_);
    std::set<double> values;
    for (size_t v = 0; v < mesh.VertexCount(); ++v) {
      values.insert(mesh.Irradiance(v)[0]);
    }
    return values;
  }

  MemoryBudget budget_{kBudgetBytes};
};

Patch Standing(PlanePoint from, PlanePoint to, double below, double above) {
  Patch wall;
  wall.origin = At(from.x, from.y) - kNormal * below;
  wall.u = At(to.x, to.y) - At(from.x, from.y);
  wall.v = kNormal * (below + above);
  return wall;
}

TEST_F(DisplayBorderTest, TouchingElementsShareTheirMean) {
  EXPECT_EQ(ValuesWith({}), (std::set<double>{1, 2, 3}));
}

TEST_F(DisplayBorderTest, AWallParts) {
  const std::set<double> apart{1, 3};
  EXPECT_EQ(ValuesWith({Standing({1, 0}, {1, 1}, 0, 2)}), apart);
  EXPECT_EQ(ValuesWith({Standing({1, 1}, {1, 0}, 0, 2)}), apart);
  EXPECT_EQ(ValuesWith({Standing({1, -1}, {1, 3}, 1, 2)}), apart);
}

TEST_F(DisplayBorderTest, AWallElsewhereDoesNotPart) {
  const std::set<double> joined{1, 2, 3};
  EXPECT_EQ(ValuesWith({Standing({0.5, 0}, {0.5, 1}, 0, 2)}), joined);
  EXPECT_EQ(ValuesWith({Standing({1, 1.5}, {1, 2}, 0, 2)}), joined);
  EXPECT_EQ(ValuesWith({Standing({1, 0}, {1, 1}, -0.1, 2)}), joined);
}

TEST_F(DisplayBorderTest, ElementsThatMeetAtACornerAreNotAveraged) {
  std::vector<Patch> patches = {MakePatch({0, 0}, {1, 0}, {0, 1}),
                                MakePatch({1, 1}, {1, 0}, {0, 1})};
  const Basis haar(1);
  const auto geometry = GeometryOf(patches);
  CellTree tree({&haar, kRgbChannels}, geometry);
  CoefficientArray gathered = ZerosFor(tree);
  gathered[ElementId(0U)][0] = 1;
  const CoplanarPatches cell(patches);
  const DisplayMesh mesh(tree, gathered, cell, 0, {}, budget_);
  EXPECT_EQ(mesh.VertexCount(), 10U);
  for (size_t v = 0; v < mesh.VertexCount(); ++v) {
    EXPECT_TRUE(mesh.Irradiance(v)[0] == 0 || mesh.Irradiance(v)[0] == 1);
  }
}

// A sliver of 3 m by 0.02 mm runs along a wall to a crumb of 0.2 mm. Quarters
// of the sliver that are no longer than the crumb would be thousands, side by
// side.
TEST_F(DisplayBorderTest, ACrumbDoesNotGrindASliver) {
  const std::vector<Patch> patches = {
      MakePatch({0, 0}, {6, 0}, {0, 3}),
      MakePatch({0, -2e-5}, {3, 0}, {0, 2e-5}),
      MakePatch({3, -2e-4}, {2e-4, 0}, {0, 2e-4})};
  const Basis haar(1);
  const auto geometry = GeometryOf(patches);
  const CellTree tree({&haar, kRgbChannels}, geometry);
  const CoplanarPatches cell(patches);
  const DisplayMesh mesh(tree, ZerosFor(tree), cell, 0, {}, budget_);
  // The wall is graded towards the crumb: some leaves at each of 15 levels.
  EXPECT_GT(mesh.Forest().Size(), 15 * 4U);
  const DisplayForest& forest = mesh.Forest();
  EXPECT_LT(forest.Size(), 1500U);
  for (size_t e = patches.size(); e < forest.Size(); ++e) {
    EXPECT_GE(forest.HeightOf(e), kCrackM);
  }
  // Balance holds for all leaves that may be split.
  for (size_t e = 0; e < forest.Size(); ++e) {
    if (!forest.IsLeaf(e) || forest.HeightOf(e) < 2 * kCrackM) {
      continue;
    }
    std::vector<uint32_t> touching;
    for (size_t other = 0; other < forest.Size(); ++other) {
      if (!forest.IsLeaf(other)) {
        continue;
      }
      for (size_t k = 0; k < forest.CornerCount(other); ++k) {
        const UnitPoint corner = UnitCorner(forest.ShapeOf(other), k);
        forest.LeavesAt(forest.PointOn(other, corner), &touching);
        if (std::find(touching.begin(), touching.end(), e) != touching.end()) {
          EXPECT_LE(forest.EdgeOf(e), 2.0001 * forest.EdgeOf(other));
        }
      }
    }
  }
}

// Slivers that are thinner than the cracks between faces and do not quite touch
// are not welded away: a point moves by an eighth of the least height at most.
// Means stay within the range of the values that they average.
TEST_F(DisplayBorderTest, SliversKeepTheirPlace) {
  Random random(9);
  for (int i = 0; i < 200; ++i) {
    const double thin = 1e-5 * (0.2 + random.Next());
    const double off = 2e-6 * (random.Next() - 0.5);
    std::vector<Patch> patches = {
        MakePatch({0, 0}, {1, 0}, {0, 1}),
        MakePatch({0, -thin}, {0.37, 0}, {0, thin + off}),
        MakePatch({0.37, -thin}, {0.63, off}, {0, thin - off})};
    const Basis haar(1);
    const auto geometry = GeometryOf(patches);
    CellTree tree({&haar, kRgbChannels}, geometry);
    tree.FindOrCreate(
        PatchId(0U), ChildPath(ChildPath(kRootPath, 0), 1), geometry);
    CoefficientArray gathered = ZerosFor(tree);
    for (size_t e = 0; e < patches.size(); ++e) {
      gathered[ElementId(e)][0] = static_cast<float>(1 + 2 * (e % 2));
    }
    const CoplanarPatches cell(patches);
    const DisplayMesh mesh(tree, gathered, cell, 0, {}, budget_);
    for (size_t v = 0; v < mesh.VertexCount(); ++v) {
      ASSERT_GE(mesh.Irradiance(v)[0], 1 - 1e-6);
      ASSERT_LE(mesh.Irradiance(v)[0], 3 + 1e-6);
    }
    double area = 0;
    for (const double share : mesh.VertexAreas()) {
      area += share;
    }
    ASSERT_NEAR(area, 1 + thin - 0.26 * off, thin / 4);
  }
}

TEST(CoplanarPatchesTest, GroupsHavePlaneSideAndMaterial) {
  const auto square = [](double x) {
    return MakePatch({x, 0}, {1, 0}, {0, 1});
  };
  std::vector<Patch> patches(8, square(0));
  patches[1] = square(5);  // in the plane, elsewhere
  patches[2].origin = patches[2].origin + kNormal * 1e-9;  // rounding
  patches[3].origin = patches[3].origin + kNormal * 1e-3;  // above
  std::swap(patches[4].u, patches[4].v);                   // the other side
  patches[5].material = MaterialId(1U);
  patches[6].emits = true;
  patches[7].reflects = false;
  const CoplanarPatches cell(patches);
  ASSERT_EQ(cell.groups.size(), 6U);
  EXPECT_EQ(cell.groups[0],
            (std::vector<PatchId>{PatchId(0U), PatchId(1U), PatchId(2U)}));
}

// Rounding parts no coplanar patches, wherever the borders between keys are.
TEST(CoplanarPatchesTest, RoundingNeverParts) {
  Random random(5);
  for (int i = 0; i < 2000; ++i) {
    std::vector<Patch> patches(2);
    patches[0].origin = {0, 0, static_cast<double>(i) * 1e-4};
    patches[0].u = {1, 0, 0};
    patches[0].v = {0, 1, 0};
    patches[1] = patches[0];
    patches[1].origin.z += 2e-9 * (random.Next() - 0.5);
    patches[1].v.z = 2e-9 * (random.Next() - 0.5);
    ASSERT_EQ(CoplanarPatches(patches).groups.size(), 1U) << i;
  }
}

// Of an oblique wall in map coordinates, too, where doubles are a nanometre
// apart.
TEST(CoplanarPatchesTest, TilesOfAFarWallAreTogether) {
  const Vec3 along = Normalize(Vec3{0.8660254037844387, 0.5, 0});
  const Vec3 up{0, 0, 1};
  std::vector<Patch> patches(12);
  for (size_t i = 0; i < patches.size(); ++i) {
    const Point3 origin{430'000.3, 5'400'000.7, 120.1};
    const auto corner = [&](size_t k) {
      return origin + along * (0.1 * static_cast<double>(k));
    };
    patches[i].origin = corner(i);
    patches[i].u = corner(i + 1) - corner(i);
    patches[i].v = up;
  }
  EXPECT_EQ(CoplanarPatches(patches).groups.size(), 1U);
}

}  // namespace
}  // namespace enfilade
