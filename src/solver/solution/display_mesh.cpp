#include "solver/solution/display_mesh.h"

#include "solver/solution/display_builder.h"

#include <algorithm>
#include <limits>

namespace enfilade {

DisplayMesh::DisplayMesh(const CellTree& tree,
                         const CoefficientArray& gathered,
                         const CoplanarPatches& cell,
                         size_t group,
                         const DisplayOptions& options,
                         MemoryBudget& budget)
    : forest_(tree, cell, group, budget),
      charge_(budget, "the display mesh of coplanar patches") {
  // A mesh is linear within its triangles, so a basis of higher order gets
  // smaller triangles.
  constexpr size_t kLinearOrder = 2;
  forest_.Balance();
  if (tree.Shape().basis->kind.order > kLinearOrder) {
    forest_.SplitLeaves();
  }
  DisplayMeshBuilder(*this, tree.Shape(), gathered).Build(cell, group, options);
}

Point3 DisplayMesh::Position(size_t vertex) const {
  return forest_.Frame().ToSpace(points_[vertex]);
}

Rgb DisplayMesh::Irradiance(size_t vertex) const {
  Rgb value{};
  std::copy(values_[vertex].begin(), values_[vertex].end(), value.begin());
  return value;
}

uint64_t DisplayMesh::SizeBytes() const {
  return leaf_of_element_.capacity() * sizeof(uint32_t) +
         leaves_.capacity() * sizeof(Leaf) +
         rings_.capacity() * sizeof(uint32_t) +
         points_.capacity() * sizeof(PlanePoint) +
         values_.capacity() * sizeof(values_[0]) +
         points_.size() * sizeof(double);  // VertexAreas
}

std::vector<double> DisplayMesh::VertexAreas() const {
  std::vector<double> areas(points_.size());
  ForEachTriangle([&](const DisplayTriangle& t) {
    const PlanePoint o = points_[t.vertices[0]];
    const double area =
        Cross(points_[t.vertices[1]] - o, points_[t.vertices[2]] - o) / 2;
    for (const uint32_t vertex : t.vertices) {
      areas[vertex] += area / 3;
    }
  });
  return areas;
}

std::array<double, 3> DisplayMesh::Barycentric(const DisplayTriangle& t,
                                               PlanePoint p) const {
  const PlanePoint o = points_[t.vertices[0]];
  const PlanePoint u = points_[t.vertices[1]] - o;
  const PlanePoint v = points_[t.vertices[2]] - o;
  const double area = Cross(u, v);
  const double a = Cross(p - o, v) / area;
  const double b = Cross(u, p - o) / area;
  return {1 - a - b, a, b};
}

Rgb DisplayMesh::IrradianceAt(PatchId patch, UnitPoint p) const {
  const size_t element = forest_.LeafOf(patch, p);
  const PlanePoint point = forest_.PointOn(forest_.RootOf(patch), p);
  // Finds the triangle in which the point lies deepest or, if rounding puts the
  // point outside all of them, the triangle that it is least outside of.
  DisplayTriangle best;
  std::array<double, 3> weights{1, 0, 0};
  double deepest = -std::numeric_limits<double>::infinity();
  VisitLeaf(leaf_of_element_[element], [&](const DisplayTriangle& t) {
    const std::array<double, 3> w = Barycentric(t, point);
    const double depth = *std::min_element(w.begin(), w.end());
    if (depth > deepest) {
      best = t;
      weights = w;
      deepest = depth;
    }
  });
  Rgb sum{};
  for (size_t c = 0; c < sum.size(); ++c) {
    for (size_t k = 0; k < weights.size(); ++k) {
      sum[c] += weights[k] * static_cast<double>(values_[best.vertices[k]][c]);
    }
  }
  return sum;
}

}  // namespace enfilade
