// The binary tree of splitting planes that cuts the building into convex
// leaves, and what is asked of it: where a point is, where a face goes.

#pragma once

#include "base/block_storage.h"
#include "base/bytes.h"
#include "base/ids.h"
#include "base/packed.h"
#include "base/vec.h"
#include "partition/polygon.h"

#include <cstdint>
#include <functional>
#include <vector>

namespace enfilade {

using LeafId = Id<struct LeafTag>;
using NodeId = Id<struct NodeTag>;

// A child of a node: another node or a leaf.
class BspChild {
 public:
  BspChild() = default;

  explicit BspChild(NodeId node) : code_(node.value) {}

  explicit BspChild(LeafId leaf) : code_(leaf.value | kLeafBit) {}

  [[nodiscard]] bool IsLeaf() const { return (code_ & kLeafBit) != 0; }

  [[nodiscard]] LeafId Leaf() const { return LeafId(code_ & ~kLeafBit); }

  [[nodiscard]] NodeId Node() const { return NodeId(code_); }

 private:
  static constexpr uint32_t kLeafBit = 0x80000000U;
  uint32_t code_ = kLeafBit;
};

struct BspNode {
  Plane plane;
  BspChild front;
  BspChild back;
};

template <>
inline constexpr bool kIsPacked<BspNode> =
    kIsPacked<Plane>&& kIsPacked<BspChild> &&
    sizeof(BspNode) == sizeof(Plane) + 2 * sizeof(BspChild);

struct BspTree {
  Box3 box;  // the region of the root
  BspChild root;
  std::vector<BspNode> nodes;  // indexed by NodeId
  uint32_t leaf_count = 1;
};

// The leaf of a point. A point in a splitting plane is in front of it.
LeafId LocateLeaf(const BspTree& tree, Point3 p);

// A part of one side of a face.
struct FacePiece {
  CellId cell;
  Polygon polygon;
};

// Sends the side of `face` that looks along `side_normal` (a unit normal of
// its plane) down the tree and returns its parts by cell. A part that lies in
// a splitting plane belongs to the side that it looks to; a cut between two
// parts that come to lie in one cell is undone.
std::vector<FacePiece> ClipSide(const BspTree& tree,
                                const std::vector<CellId>& cell_of_leaf,
                                const Polygon& face,
                                const Vec3& side_normal);

// Stored as kPortals blocks {chunk, 1} beside the portals: tree, and the cell
// of each leaf.
void SaveTree(const BspTree& tree,
              const std::vector<CellId>& cell_of_leaf,
              BlockStorage& store);

// Says in which cell a point lies. For tests and audits; holds the whole tree.
class PartitionLocator {
 public:
  explicit PartitionLocator(const BlockStorage& store);

  // The cell of a point in the partition's box; a point on a boundary belongs
  // to one of its cells.
  [[nodiscard]] CellId Locate(Point3 p) const;

  [[nodiscard]] const Box3& Box() const { return tree_.box; }

  [[nodiscard]] size_t LeafCount() const { return tree_.leaf_count; }

 private:
  BspTree tree_;
  std::vector<CellId> cell_of_leaf_;
};

}  // namespace enfilade
