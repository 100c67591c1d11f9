// Clusters: a hierarchy above the patches of a cell, or above the elements at
// which refinement begins. The hierarchy bounds what one group of elements can
// receive from another, so that the pairs of patches need not be examined one
// by one: docs/decisions/0013-clusters.md.
//
// Items are first grouped by the main direction of their normals, so that the
// bounds of a cluster reflect which way it faces, and then halved in space.

#pragma once

#include "solver/elements/element_tree.h"
#include "solver/elements/geometry.h"

#include <cstdint>
#include <span>
#include <vector>

namespace enfilade {

// An element at which refinement begins: a patch or, if the patch is partly
// covered, an element of the patch.
struct ClusterItem {
  uint32_t patch = 0;
  ElementPath path = kRootPath;
};

// A node of items [first, first + count). Nodes `child` and `child` + 1 split
// the items; a node whose child is 0 is a leaf.
struct Cluster {
  Box box;                 // of the items' corners
  Box normals;             // of the items' unit normals
  float largest_area = 0;  // m2, of a single item
  uint32_t first = 0;
  uint32_t count = 0;
  uint32_t child = 0;
};

class ClusterTree {
 public:
  // `items` may be empty and in any order; Items() gives the order of the tree.
  ClusterTree(std::span<const PatchGeometry> patches,
              std::vector<ClusterItem> items);

  [[nodiscard]] std::span<const ClusterItem> Items() const { return items_; }

  // Node 0 is the root; parents precede their children.
  [[nodiscard]] std::span<const Cluster> Clusters() const { return clusters_; }

  // For each node, the largest value of its items; `values` are in the order of
  // Items().
  [[nodiscard]] std::vector<float> LargestOf(
      std::span<const float> values) const;

  [[nodiscard]] uint64_t SizeBytes() const;

  // An upper bound of the bytes that a tree of so many items takes while it is
  // built.
  static uint64_t BytesFor(size_t items);

  // About the bytes that a tree of so many items holds.
  static uint64_t HeldBytesFor(size_t items);

 private:
  struct Entry;

  static size_t MostClusters(size_t items);

  void Build(std::vector<Entry>* entries, uint32_t node);

  std::vector<ClusterItem> items_;
  std::vector<Cluster> clusters_;
};

// One item per patch, which is the whole patch.
std::vector<ClusterItem> WholePatches(size_t count);

// Bounds of the transfer between any two items of two clusters.
struct ClusterBound {
  bool behind = false;    // no item of one has an item of the other in front
  float form_factor = 1;  // the largest from a point of the receiver
  float per_area = 0;     // the same per m2 of source; huge if they touch
};

ClusterBound BoundOf(const Cluster& receiver, const Cluster& source);

}  // namespace enfilade
