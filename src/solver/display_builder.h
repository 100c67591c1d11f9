// How a DisplayMesh is built: weld the corners of the leaves, anchor, take the
// leaves' values, join leaves over edges, average.

#pragma once

#include "solver/display_mesh.h"

#include <array>
#include <cstdint>
#include <span>
#include <unordered_map>
#include <vector>

namespace enfilade {

// Gives points that are closer than a tolerance one number.
class PointWelder {
 public:
  explicit PointWelder(double tolerance_m);

  // The point's number: that of an earlier one, or the next.
  uint32_t Add(PlanePoint p);

  [[nodiscard]] const std::vector<PlanePoint>& Points() const {
    return points_;
  }

  // Of a point, in all.
  static constexpr uint64_t kPointBytes = 96;

 private:
  [[nodiscard]] uint64_t Key(double x, double y) const;

  double tolerance_m_;
  double slot_m_;
  std::vector<PlanePoint> points_;
  std::vector<uint32_t> next_;  // point of the same slot; itself: none
  std::unordered_map<uint64_t, uint32_t> slots_;
};

class DisplayMeshBuilder {
 public:
  DisplayMeshBuilder(DisplayMesh& mesh, const CellTree& tree)
      : mesh_(mesh), forest_(mesh.forest_), tree_(tree) {}

  void Build(std::span<const Patch> patches,
             std::span<const PatchId> group,
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
    uint64_t key = 0;    // its vertices
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
  void JoinLeaves(std::span<const Patch> patches,
                  std::span<const PatchId> group);
  void SortEdges();
  [[nodiscard]] uint32_t ClassOf(uint32_t place);
  void Join(uint32_t a, uint32_t b);
  void MakeVertices();

  DisplayMesh& mesh_;
  const DisplayForest& forest_;
  const CellTree& tree_;
  std::vector<PlanePoint> welded_;
  std::vector<std::array<uint32_t, 4>> corners_;  // indexed by leaf: welded
  std::vector<Hanging> hanging_;
  // Indexed by place in the rings:
  std::vector<Value> own_;        // of the leaf
  std::vector<float> weights_;    // area of the leaf's triangles there, m2
  std::vector<uint32_t> joined_;  // union-find
  std::vector<Value> centres_;    // indexed by leaf
  std::vector<RingEdge> edges_;
};

}  // namespace enfilade
