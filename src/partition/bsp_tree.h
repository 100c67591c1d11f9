// The binary tree of splitting planes that cuts the building into convex
// leaves. The tree says which leaf a point lies in, and clips faces to cells.

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

// The leaf that contains a point. A point in a splitting plane counts as in
// front of the plane.
LeafId LocateLeaf(const BspTree& tree, Point3 p);

// A part of one side of a face.
struct FacePiece {
  CellId cell;
  Polygon polygon;
};

// Sends the side of `face` that looks along `side_normal` (a unit normal of the
// face's plane) down the tree and returns the parts of that side by cell. A
// part that lies in a splitting plane belongs to the half that the side looks
// into. Two parts that end up in the same cell are put together again.
std::vector<FacePiece> ClipSide(const BspTree& tree,
                                const std::vector<CellId>& cell_of_leaf,
                                const Polygon& face,
                                const Vec3& side_normal);

// Stores the tree and the cell of each leaf as kPortals blocks {chunk, 1},
// beside the portals.
void SaveTree(const BspTree& tree,
              const std::vector<CellId>& cell_of_leaf,
              BlockStorage& store);

// Says in which cell a point lies. For tests and audits: it holds the whole
// tree in memory.
class PartitionLocator {
 public:
  explicit PartitionLocator(const BlockStorage& store);

  // The cell of a point in the partition's box. A point on a boundary belongs
  // to one of the cells that meet there.
  [[nodiscard]] CellId Locate(Point3 p) const;

  [[nodiscard]] const Box3& Box() const { return tree_.box; }

  [[nodiscard]] size_t LeafCount() const { return tree_.leaf_count; }

 private:
  BspTree tree_;
  std::vector<CellId> cell_of_leaf_;
};

}  // namespace enfilade
