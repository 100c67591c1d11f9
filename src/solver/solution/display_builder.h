// How a DisplayMesh is built: weld the corners of the leaves, anchor, take the
// leaves' values, join leaves over edges, average.

#pragma once

#include "base/disjoint_sets.h"
#include "solver/solution/display_mesh.h"

#include <array>
#include <cstdint>
#include <vector>

namespace enfilade {

class DisplayMeshBuilder {
 public:
  DisplayMeshBuilder(DisplayMesh& mesh,
                     const TreeShape& shape,
                     const CoefficientArray& gathered)
      : mesh_(mesh),
        forest_(mesh.forest_),
        shape_(shape),
        gathered_(gathered) {}

  void Build(const CoplanarPatches& cell,
             size_t group,
             const DisplayOptions& options);

 private:
  using Value = std::array<float, kRgbChannels>;

  // A vertex on the edge of a leaf, between its corners.
  struct Hanging {
    uint32_t leaf = 0;
    uint32_t edge = 0;
    double along = 0;  // 0 to 1
    uint32_t vertex = 0;
  };

  // An edge of a leaf's ring.
  struct RingEdge {
    uint64_t key = 0;    // both vertices
    uint32_t begin = 0;  // places in the rings
    uint32_t end = 0;
  };

  void NumberLeaves();
  void WeldCorners();
  void FindHanging();
  void AddHanging(uint32_t leaf, uint32_t vertex);
  void MakeRings();
  void PutCorner(uint32_t vertex, size_t begin);
  void TakeValues();
  void TakeLeafValues(size_t leaf);
  void WeighLeaf(size_t leaf);
  void JoinLeaves(const CoplanarPatches& cell, size_t group);
  void SortEdges();
  void MakeVertices();
  void AddCentres();
  void Recharge(uint64_t more);

  DisplayMesh& mesh_;
  const DisplayForest& forest_;
  const TreeShape shape_;
  const CoefficientArray& gathered_;
  std::vector<PlanePoint> welded_;
  std::vector<std::array<uint32_t, 4>> corners_;  // by leaf; into welded_
  std::vector<Hanging> hanging_;
  // Indexed by place in the rings:
  std::vector<Value> own_;      // the leaf's irradiance, W/m2
  std::vector<float> weights_;  // area of the leaf's triangles there, m2
  DisjointSets joined_;
  std::vector<Value> centres_;  // indexed by leaf
  std::vector<RingEdge> edges_;
};

}  // namespace enfilade
