// Which leaves and which nodes' planes of the tree the faces of the scene lie
// in.

#pragma once

#include "base/block_storage.h"
#include "partition/bsp_builder.h"
#include "scene/scene_store.h"

namespace enfilade {

// The memory that a cover takes in a list that has grown to hold it.
inline uint64_t BytesOfCover(const Polygon& polygon) {
  return 2 * sizeof(Polygon) + polygon.size() * sizeof(Point3) +
         kAllocationHeaderBytes;
}

// Sends the faces of the scene down the tree.
class FaceSorter {
 public:
  virtual ~FaceSorter() = default;

  void AddAll(const BlockStorage& store) {
    ForEachFace(store, [this](FaceId, const Face& face) {
      for (const Polygon& part : PlanarParts(face.vertices)) {
        Descend(tree_->root, part, PlaneOf(part).normal, kBothSides);
      }
    });
  }

 protected:
  explicit FaceSorter(const BspTree& tree) : tree_(&tree) {}

  // Adds a piece of a face with one or two of its sides in the leaf.
  virtual void AddToLeaf(LeafId leaf, const Polygon& piece, uint32_t sides) = 0;
  // Adds a piece of a face that lies in the plane of the node.
  virtual void AddCover(NodeId node, const Polygon& piece) = 0;

 private:
  static constexpr int kFrontSide = 1;
  static constexpr int kBackSide = 2;
  static constexpr int kBothSides = 3;

  void Descend(BspChild child,
               const Polygon& polygon,
               const Vec3& normal,
               int sides) {
    if (child.IsLeaf()) {
      return AddToLeaf(child.Leaf(), polygon, sides == kBothSides ? 2 : 1);
    }
    const BspNode& node = tree_->nodes[child.Node().Index()];
    switch (Classify(polygon, node.plane, kOnPlaneM)) {
      case PlaneSide::kFront:
        return Descend(node.front, polygon, normal, sides);
      case PlaneSide::kBack:
        return Descend(node.back, polygon, normal, sides);
      case PlaneSide::kOn:
        return Cover(child.Node(), polygon, normal, sides);
      case PlaneSide::kCut:
        break;
    }
    const SplitPolygons parts = Split(polygon, node.plane, kOnPlaneM);
    if (PolygonArea(parts.front) > kLeastAreaM2) {
      Descend(node.front, parts.front, normal, sides);
    }
    if (PolygonArea(parts.back) > kLeastAreaM2) {
      Descend(node.back, parts.back, normal, sides);
    }
  }

  void Cover(NodeId id, const Polygon& polygon, const Vec3& normal, int sides) {
    AddCover(id, polygon);
    const BspNode& node = tree_->nodes[id.Index()];
    const bool ahead = Dot(normal, node.plane.normal) > 0;
    for (const int side : {kFrontSide, kBackSide}) {
      if ((sides & side) != 0) {
        const bool to_front = (side == kFrontSide) == ahead;
        Descend(to_front ? node.front : node.back, polygon, normal, side);
      }
    }
  }

  const BspTree* tree_;
};

}  // namespace enfilade
