// Emitters and their choice by importance, for sampling direct light.
//
// Notation
//   P(e | x)   probability of choosing emitter e from the receiver x
//   A_e        area of emitter e; a point on it has density P / A_e
//
// The tree is the light hierarchy of Conty Estevez & Kulla, "Importance
// Sampling of Many Lights with Adaptive Tree Splitting" (2018), without the
// splitting: a binary tree over the emitting patches, each node with its
// bounding sphere, power and cone of normals; a walk from the root picks a
// child in proportion to a bound of what it sends to the receiver.
//
// Estimators stay unbiased for any P, zero included, as long as they weight all
// their strategies with the same P. The tree may therefore leave out emitters
// when memory is short; it then keeps those with the largest exitance.

#pragma once

#include "base/memory.h"

#include <cstdint>
#include <optional>
#include <vector>

#include "tools/building_view.h"

namespace enfilade {

struct Emitter {
  CellId cell;
  PatchId patch;
  PatchShape shape{};
  MaterialId material;
  Point3 origin;
  Vec3 u, v;
  Vec3 normal;      // unit length
  double area = 0;  // m2
};

class EmitterTree {
 public:
  struct Choice {
    const Emitter* emitter = nullptr;
    double probability = 0;  // P > 0
  };

  // Reads all cells once. Keeps at most the emitters that fit `max_bytes`,
  // charged to the budget.
  EmitterTree(const BuildingView& view,
              MemoryBudget& budget,
              uint64_t max_bytes);

  // Chooses an emitter by `s`, uniform in [0, 1). Returns nothing if the tree
  // finds that no emitter can reach the point on the side of the normal.
  [[nodiscard]] std::optional<Choice> Choose(Point3 x,
                                             Vec3 normal,
                                             double s) const;

  // P / A of this patch from the point, in 1/m2; 0 if it is not in the tree.
  [[nodiscard]] double Density(Point3 x,
                               Vec3 normal,
                               CellId cell,
                               PatchId patch) const;

  // In the order of the tree's leaves.
  [[nodiscard]] const std::vector<Emitter>& Emitters() const {
    return emitters_;
  }

  // Index of this patch in Emitters(), if it is there.
  [[nodiscard]] std::optional<uint32_t> Find(CellId cell, PatchId patch) const;

  // P of one emitter.
  [[nodiscard]] double Probability(size_t leaf, Point3 x, Vec3 normal) const;

  // A lamp is either the facets of a bulb, which are the emitters below one
  // node, or a single emitter. Every emitter belongs to one lamp.
  struct Lamp {
    uint32_t node = 0;
    uint32_t first = 0;  // of Emitters()
    uint32_t count = 0;
  };

  // The lamps, in the order of their emitters in Emitters().
  [[nodiscard]] const std::vector<Lamp>& Lamps() const { return lamps_; }

  // Index in Lamps() of the lamp that an emitter belongs to.
  [[nodiscard]] uint32_t LampOf(uint32_t leaf) const;

  // Appends the indices of the lamps with emitters in a cell.
  void AppendLampsOfCell(CellId cell, std::vector<uint32_t>& indices) const;

  // As Choose and Probability, among the emitters of one lamp.
  [[nodiscard]] std::optional<Choice> ChooseIn(const Lamp& lamp,
                                               Point3 x,
                                               Vec3 normal,
                                               double s) const;
  [[nodiscard]] double ProbabilityIn(const Lamp& lamp,
                                     size_t leaf,
                                     Point3 x,
                                     Vec3 normal) const;

  // Exitance times area, summed over the channels.
  [[nodiscard]] double Power(const Lamp& lamp) const {
    return nodes_[lamp.node].power;
  }

  // Centre and radius of the lamp's bounding sphere.
  [[nodiscard]] Point3 Center(const Lamp& lamp) const {
    return nodes_[lamp.node].center;
  }

  [[nodiscard]] double Radius(const Lamp& lamp) const {
    return nodes_[lamp.node].radius;
  }

  // A bound, up to a factor, of the light that a lamp sends to x. It is
  // positive if the lamp can send any.
  [[nodiscard]] double LampImportance(const Lamp& lamp,
                                      Point3 x,
                                      Vec3 normal) const {
    return Importance(nodes_[lamp.node], x, normal);
  }

 private:
  struct Node {
    Point3 center;
    Vec3 axis;           // of the cone of normals
    float radius = 0;    // of the bounding sphere
    float cos_cone = 1;  // half-angle of the cone
    float power = 0;
  };

  void Gather(const BuildingView& view, size_t max_count);
  void Sort(size_t first, size_t last);
  Node Build(size_t node, size_t first, size_t last);
  void FindLamps(size_t node, size_t first, size_t last);
  [[nodiscard]] static Node LeafNode(const Emitter& emitter, double exitance);
  [[nodiscard]] static Node Merge(const Node& left, const Node& right);
  [[nodiscard]] static double Importance(const Node& node,
                                         Point3 x,
                                         Vec3 normal);
  [[nodiscard]] double LeftShare(size_t node,
                                 size_t left_count,
                                 Point3 x,
                                 Vec3 normal) const;

  const SceneInfo* scene_;
  GrowingCharge charge_;
  std::vector<Emitter> emitters_;  // leaves from left to right
  std::vector<Node> nodes_;        // in preorder
  std::vector<Lamp> lamps_;
  std::vector<uint32_t> by_id_;  // indices of emitters_, by cell and patch
};

}  // namespace enfilade
