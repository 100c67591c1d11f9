// Meshes for display: the leaves of coplanar patches as conforming triangles,
// with one irradiance value at each vertex.
//
//   balanced  touching leaves differ by at most one level (display_forest.h)
//   anchored  no T-vertices: a vertex on the edge of a leaf is a corner of that
//             leaf's triangles (Baum et al., "Making radiosity usable", 1991;
//             Willmott and Heckbert 1997, section 2.5)
//   smooth    the value of a vertex is the mean of the values of the leaves
//             around it, each weighted by the area of the leaf's triangles at
//             that vertex
//
// A leaf's own value at a vertex is that of its basis, so the mesh reproduces a
// polynomial that the basis holds. A parallelogram, or a triangle with vertices
// on an edge, is a fan of triangles around its centre. With these weights the
// integral of the mesh equals the integral of the leaves' values over the same
// triangles; fans keep the integral exact for constant, linear and bilinear
// leaves:
//
//   sum_v (1/3 sum_t A_t) (sum_t A_t f_t(v)) / (sum_t A_t)
//     = sum_t A_t/3 sum_v f_t(v)
//
// A vertex value is the mean over leaves of one group of CoplanarPatches, and
// so of one cell, that are joined by edges around the vertex. An edge on which
// another patch of the cell stands (StandingSegments) joins no leaves.

#pragma once

#include "base/ids.h"
#include "base/memory.h"
#include "base/photometry.h"
#include "partition/patch.h"
#include "solver/elements/element_tree.h"
#include "solver/solution/display_forest.h"

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace enfilade {

struct DisplayTriangle {
  PatchId patch;
  std::array<uint32_t, 3> vertices{};  // counter-clockwise from the front
};

struct DisplayOptions {
  // Average at vertices; else every leaf has vertices of its own.
  bool smooth = true;
};

// The mesh of one group of coplanar patches.
class DisplayMesh {
 public:
  // `tree` is that of the cell; `gathered` is indexed by its elements
  // (ReceivedLight). The mesh charges its memory to `budget` while it is built
  // and as long as it lives; throws DoesNotFitError.
  DisplayMesh(const CellTree& tree,
              const CoefficientArray& gathered,
              const CoplanarPatches& cell,
              size_t group,
              const DisplayOptions& options,
              MemoryBudget& budget);

  [[nodiscard]] size_t VertexCount() const { return points_.size(); }

  [[nodiscard]] Point3 Position(size_t vertex) const;

  // W/m2.
  [[nodiscard]] Rgb Irradiance(size_t vertex) const;

  // Visits the triangles in a fixed order.
  template <typename Visit>
  void ForEachTriangle(const Visit& visit) const {
    for (size_t leaf = 0; leaf < leaves_.size(); ++leaf) {
      VisitLeaf(leaf, visit);
    }
  }

  // A third of the area of the triangles around each vertex, m2. The mesh's
  // charge includes this array.
  [[nodiscard]] std::vector<double> VertexAreas() const;

  // Irradiance at patch coordinates `p`, W/m2, interpolated linearly in the
  // triangle that holds the point. Requires a patch of the group.
  [[nodiscard]] Rgb IrradianceAt(PatchId patch, UnitPoint p) const;

  [[nodiscard]] const DisplayForest& Forest() const { return forest_; }

 private:
  friend class DisplayMeshBuilder;

  static constexpr uint32_t kNoCentre = UINT32_MAX;

  struct Leaf {
    uint32_t element = 0;
    uint32_t ring = 0;            // begin of its vertices in rings_
    uint32_t centre = kNoCentre;  // vertex
  };

  [[nodiscard]] std::span<const uint32_t> Ring(size_t leaf) const {
    const size_t begin = leaves_[leaf].ring;
    const size_t end =
        leaf + 1 < leaves_.size() ? leaves_[leaf + 1].ring : rings_.size();
    return std::span(rings_).subspan(begin, end - begin);
  }

  template <typename Visit>
  void VisitLeaf(size_t leaf, const Visit& visit) const {
    const std::span<const uint32_t> ring = Ring(leaf);
    const PatchId patch = forest_.PatchOf(leaves_[leaf].element);
    if (leaves_[leaf].centre == kNoCentre) {
      if (ring.size() == 3) {
        visit(DisplayTriangle{patch, {ring[0], ring[1], ring[2]}});
      }
      return;
    }
    for (size_t i = 0; i < ring.size(); ++i) {
      visit(DisplayTriangle{
          patch, {ring[i], ring[(i + 1) % ring.size()], leaves_[leaf].centre}});
    }
  }

  [[nodiscard]] uint64_t SizeBytes() const;

  // The barycentric weights of the triangle's vertices at a point of the plane.
  [[nodiscard]] std::array<double, 3> Barycentric(const DisplayTriangle& t,
                                                  PlanePoint p) const;

  DisplayForest forest_;
  GrowingCharge charge_;
  std::vector<uint32_t> leaf_of_element_;  // indexed by element; leaves only
  std::vector<Leaf> leaves_;
  std::vector<uint32_t> rings_;     // vertices around each leaf, leaf by leaf
  std::vector<PlanePoint> points_;  // indexed by vertex
  std::vector<std::array<float, kRgbChannels>> values_;  // irradiance, W/m2
};

}  // namespace enfilade
