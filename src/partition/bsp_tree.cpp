#include "partition/bsp_tree.h"

#include <algorithm>
#include <span>
#include <utility>

namespace enfilade {
namespace {

constexpr size_t kItemsPerChunk = 65536;
constexpr uint32_t kTreeBlock = 1;

// The arguments of one call of ClipSide that stay the same down the tree.
class SideClipper {
 public:
  SideClipper(const BspTree& tree,
              const std::vector<CellId>& cell_of_leaf,
              const Vec3& side_normal)
      : tree_(&tree), cell_of_leaf_(&cell_of_leaf), normal_(side_normal) {}

  [[nodiscard]] std::vector<FacePiece> Clip(BspChild child,
                                            const Polygon& polygon) const {
    if (child.IsLeaf()) {
      return {{(*cell_of_leaf_)[child.Leaf().Index()], polygon}};
    }
    const BspNode& node = tree_->nodes[child.Node().Index()];
    switch (Classify(polygon, node.plane, kOnPlaneM)) {
      case PlaneSide::kFront:
        return Clip(node.front, polygon);
      case PlaneSide::kBack:
        return Clip(node.back, polygon);
      case PlaneSide::kOn:
        return Clip(
            Dot(normal_, node.plane.normal) > 0 ? node.front : node.back,
            polygon);
      case PlaneSide::kCut:
        break;
    }
    return ClipCut(node, polygon);
  }

 private:
  [[nodiscard]] std::vector<FacePiece> ClipCut(const BspNode& node,
                                               const Polygon& polygon) const {
    const SplitPolygons parts = Split(polygon, node.plane, kOnPlaneM);
    auto front = ClipPart(node.front, parts.front);
    auto back = ClipPart(node.back, parts.back);
    if (front.empty()) {
      std::swap(front, back);
    }
    const bool one_cell =
        front.size() == 1 &&
        (back.empty() || (back.size() == 1 && back[0].cell == front[0].cell));
    if (one_cell) {
      front[0].polygon = polygon;
      return front;
    }
    std::move(back.begin(), back.end(), std::back_inserter(front));
    return front;
  }

  [[nodiscard]] std::vector<FacePiece> ClipPart(BspChild child,
                                                const Polygon& part) const {
    if (part.size() < 3 || PolygonArea(part) < kLeastAreaM2) {
      return {};
    }
    return Clip(child, part);
  }

  const BspTree* tree_;
  const std::vector<CellId>* cell_of_leaf_;
  Vec3 normal_;
};

// Appends the chunks of an array of items as blocks {first + i, kTreeBlock}.
template <typename T>
uint32_t PutChunks(std::span<const T> items,
                   uint32_t first,
                   BlockStorage& store) {
  for (size_t start = 0; start < items.size(); start += kItemsPerChunk) {
    ByteWriter writer;
    writer.PutArray(
        items.subspan(start, std::min(kItemsPerChunk, items.size() - start)));
    store.Put({BlockKind::kPortals, first++, kTreeBlock}, writer.View());
  }
  return first;
}

template <typename T>
uint32_t GetChunks(size_t count,
                   uint32_t first,
                   const BlockStorage& store,
                   std::vector<T>& items) {
  while (items.size() < count) {
    const BlockKey key{BlockKind::kPortals, first++, kTreeBlock};
    const auto chunk = ReadBlock(store, key, [](ByteReader& in) {
      auto some = in.GetArray<T>();
      if (some.empty()) {
        throw DamagedStoreError("it is empty");
      }
      return some;
    });
    items.insert(items.end(), chunk.begin(), chunk.end());
  }
  return first;
}

}  // namespace

LeafId LocateLeaf(const BspTree& tree, Point3 p) {
  BspChild child = tree.root;
  while (!child.IsLeaf()) {
    const BspNode& node = tree.nodes[child.Node().Index()];
    child = node.plane.Distance(p) >= 0 ? node.front : node.back;
  }
  return child.Leaf();
}

std::vector<FacePiece> ClipSide(const BspTree& tree,
                                const std::vector<CellId>& cell_of_leaf,
                                const Polygon& face,
                                const Vec3& side_normal) {
  return SideClipper(tree, cell_of_leaf, side_normal).Clip(tree.root, face);
}

void SaveTree(const BspTree& tree,
              const std::vector<CellId>& cell_of_leaf,
              BlockStorage& store) {
  ByteWriter writer;
  writer.Put(tree.box);
  writer.Put(tree.root);
  writer.PutVarint(tree.nodes.size());
  writer.PutVarint(cell_of_leaf.size());
  store.Put({BlockKind::kPortals, 0, kTreeBlock}, writer.View());
  const uint32_t next =
      PutChunks(std::span<const BspNode>(tree.nodes), 1, store);
  PutChunks(std::span<const CellId>(cell_of_leaf), next, store);
}

PartitionLocator::PartitionLocator(const BlockStorage& store) {
  const auto [nodes, leaves] = ReadBlock(
      store, {BlockKind::kPortals, 0, kTreeBlock}, [&](ByteReader& in) {
        tree_.box = in.Get<Box3>();
        tree_.root = in.Get<BspChild>();
        const uint64_t node_count = in.GetVarint();
        return std::pair(node_count, in.GetVarint());
      });
  const uint32_t next = GetChunks(nodes, 1, store, tree_.nodes);
  GetChunks(leaves, next, store, cell_of_leaf_);
  tree_.leaf_count = static_cast<uint32_t>(leaves);
}

CellId PartitionLocator::Locate(Point3 p) const {
  return cell_of_leaf_[LocateLeaf(tree_, p).Index()];
}

}  // namespace enfilade
