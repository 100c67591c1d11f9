// Clusters: a hierarchy above the patches of a cell, or above the elements of
// them at which refinement begins. It exists to bound what one group of
// elements can receive from another, so that the pairs of patches are never
// looked at one by one: docs/decisions/0013-clusters.md.
//
// Items are grouped by the main direction of their normals first, so that a
// cluster's bounds know which way it faces, then halved in space.

#pragma once

#include "solver/elements/element_tree.h"
#include "solver/elements/geometry.h"

#include <cstdint>
#include <span>
#include <vector>

namespace enfilade {

// An element at which refinement begins: a patch or, where it is covered in
// parts, an element of it.
struct ClusterItem {
  uint32_t patch = 0;
  ElementPath path = kRootPath;
};

// A node: items [first, first + count), halved by the children child and
// child + 1, or a leaf where child is 0.
struct Cluster {
  Box box;                 // of the corners
  Box normals;             // of the unit normals
  float largest_area = 0;  // m2, of an item
  uint32_t first = 0;
  uint32_t count = 0;
  uint32_t child = 0;
};

class ClusterTree {
 public:
  // `items` in any order; their order afterwards is Items(). Empty is allowed.
  ClusterTree(std::span<const PatchGeometry> patches,
              std::vector<ClusterItem> items);

  [[nodiscard]] std::span<const ClusterItem> Items() const { return items_; }

  // Node 0 is the root; parents precede their children.
  [[nodiscard]] std::span<const Cluster> Clusters() const { return clusters_; }

  // Per node, the largest of its items' values (in the order of Items()).
  [[nodiscard]] std::vector<float> LargestOf(
      std::span<const float> values) const;

  [[nodiscard]] uint64_t SizeBytes() const;

  // An upper bound of what a tree of so many items takes, while it is built.
  static uint64_t BytesFor(size_t items);

  // About what a tree of so many items will hold.
  static uint64_t HeldBytesFor(size_t items);

 private:
  struct Entry;

  static size_t MostClusters(size_t items);

  void Build(std::vector<Entry>* entries, uint32_t node);

  std::vector<ClusterItem> items_;
  std::vector<Cluster> clusters_;
};

// One item per patch, each the whole patch.
std::vector<ClusterItem> WholePatches(size_t count);

// Of the transfers between any two items of two clusters.
struct ClusterBound {
  bool behind = false;    // no item of one has any item of the other in front
  float form_factor = 1;  // the largest, from a point of the receiver
  float per_area = 0;     // the same per m2 of source; huge if they touch
};

ClusterBound BoundOf(const Cluster& receiver, const Cluster& source);

}  // namespace enfilade
