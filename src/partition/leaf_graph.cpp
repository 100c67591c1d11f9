#include "partition/leaf_graph.h"

#include "base/stop.h"

#include <algorithm>
#include <utility>

namespace enfilade {
namespace {

// What CutIntoPatches makes of a polygon, at most.
uint32_t CountPatches(const Polygon& polygon) {
  const auto n = static_cast<uint32_t>(polygon.size());
  if (n == 4) {
    const Vec3 gap = (polygon[1] - polygon[0]) - (polygon[2] - polygon[3]);
    return Length(gap) < kRoundingM ? 1 : 2;
  }
  return n < 3 ? 0 : n - 2;
}

// Sends the faces down the tree.
class Surveyor {
 public:
  Surveyor(const BspTree& tree, MemoryBudget& budget)
      : tree_(&tree), budget_(&budget) {
    survey_.covers.resize(tree.nodes.size());
    survey_.patches.resize(tree.leaf_count);
    survey_.area_m2.resize(tree.leaf_count);
    bytes_ = tree.nodes.size() * sizeof(std::vector<Polygon>) +
             tree.leaf_count * (sizeof(uint32_t) + sizeof(float));
    Charge();
  }

  void Add(const Polygon& polygon) {
    for (const Polygon& part : PlanarParts(polygon)) {
      Descend(tree_->root, part, PlaneOf(part).normal, kBothSides);
    }
  }

  FaceSurvey Finish() { return std::move(survey_); }

 private:
  static constexpr int kFrontSide = 1;
  static constexpr int kBackSide = 2;
  static constexpr int kBothSides = 3;

  void Descend(BspChild child,
               const Polygon& polygon,
               const Vec3& normal,
               int sides) {
    if (child.IsLeaf()) {
      const uint32_t count = sides == kBothSides ? 2 : 1;
      survey_.patches[child.Leaf().Index()] += CountPatches(polygon) * count;
      survey_.area_m2[child.Leaf().Index()] +=
          static_cast<float>(PolygonArea(polygon) * count);
      return;
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
    survey_.covers[id.Index()].push_back(polygon);
    bytes_ += sizeof(Polygon) + polygon.size() * sizeof(Point3) +
              kAllocationHeaderBytes;
    if (bytes_ > survey_.charge.Bytes()) {
      Charge();
    }
    const BspNode& node = tree_->nodes[id.Index()];
    const bool ahead = Dot(normal, node.plane.normal) > 0;
    for (const int side : {kFrontSide, kBackSide}) {
      if ((sides & side) != 0) {
        const bool to_front = (side == kFrontSide) == ahead;
        Descend(to_front ? node.front : node.back, polygon, normal, side);
      }
    }
  }

  void Charge() {
    survey_.charge.Reset();
    survey_.charge = MemoryCharge(*budget_,
                                  bytes_ + bytes_ / 2 + kChargeStepBytes,
                                  "the walls between the cells");
  }

  const BspTree* tree_;
  MemoryBudget* budget_;
  FaceSurvey survey_;
  uint64_t bytes_ = 0;
};

uint64_t BytesOf(const std::vector<Polygon>& polygons) {
  uint64_t bytes = 0;
  for (const Polygon& polygon : polygons) {
    bytes += sizeof(Polygon) + kAllocationHeaderBytes +
             polygon.capacity() * sizeof(Point3);
  }
  return bytes;
}

// A piece of a node's section on its way to the leaves.
struct SectionPiece {
  LeafId leaf;
  Polygon polygon;
};

void PushDown(const BspTree& tree,
              BspChild child,
              const Polygon& polygon,
              std::vector<SectionPiece>& pieces) {
  if (child.IsLeaf()) {
    pieces.push_back({child.Leaf(), polygon});
    return;
  }
  const BspNode& node = tree.nodes[child.Node().Index()];
  switch (Classify(polygon, node.plane, kRoundingM)) {
    case PlaneSide::kFront:
      return PushDown(tree, node.front, polygon, pieces);
    case PlaneSide::kBack:
      return PushDown(tree, node.back, polygon, pieces);
    case PlaneSide::kOn:
      // It may border on either.
      PushDown(tree, node.front, polygon, pieces);
      return PushDown(tree, node.back, polygon, pieces);
    case PlaneSide::kCut:
      break;
  }
  const SplitPolygons parts = Split(polygon, node.plane, kRoundingM);
  if (PolygonArea(parts.front) > kLeastAreaM2) {
    PushDown(tree, node.front, parts.front, pieces);
  }
  if (PolygonArea(parts.back) > kLeastAreaM2) {
    PushDown(tree, node.back, parts.back, pieces);
  }
}

// The covers of one node with their boxes, sorted for quick refusal.
class CoverIndex {
 public:
  // What one of so many takes, and the list of those that are near.
  static uint64_t BytesFor(size_t covers) {
    constexpr uint64_t kGrowth = 2;
    return covers * (sizeof(Entry) + kGrowth * sizeof(const Polygon*));
  }

  explicit CoverIndex(const std::vector<Polygon>& covers) {
    entries_.reserve(covers.size());
    for (const Polygon& cover : covers) {
      entries_.push_back({BoundsOf(cover), &cover});
    }
  }

  [[nodiscard]] std::vector<const Polygon*> Near(const Polygon& polygon) const {
    Box3 box = BoundsOf(polygon);
    const Vec3 margin{kOnPlaneM, kOnPlaneM, kOnPlaneM};
    box.low = box.low - margin;
    box.high = box.high + margin;
    std::vector<const Polygon*> near;
    for (const Entry& entry : entries_) {
      if (entry.box.Overlaps(box)) {
        near.push_back(entry.cover);
      }
    }
    return near;
  }

 private:
  struct Entry {
    Box3 box;
    const Polygon* cover;
  };

  std::vector<Entry> entries_;
};

// What pieces take in a vector that grows.
uint64_t BytesOf(const std::vector<SectionPiece>& pieces) {
  constexpr uint64_t kGrowth = 2;
  uint64_t bytes = 0;
  for (const SectionPiece& piece : pieces) {
    bytes += kGrowth * sizeof(SectionPiece) + kAllocationHeaderBytes +
             piece.polygon.capacity() * sizeof(Point3);
  }
  return bytes;
}

// Finds the borders of one node after the other, and charges what they take.
class BorderFinder {
 public:
  // `covers`: of all nodes together.
  BorderFinder(const BspTree& tree, size_t covers, GrowingCharge& charge)
      : tree_(&tree), all_covers_(covers), charge_(&charge) {}

  void AddNode(NodeId id,
               const Polygon& section,
               const std::vector<Polygon>& covers) {
    node_bytes_ = CoverIndex::BytesFor(covers.size());
    ChargeWith(0, 0);
    const CoverIndex index(covers);
    const BspNode& node = tree_->nodes[id.Index()];
    std::vector<SectionPiece> in_front;
    PushDown(*tree_, node.front, section, in_front);
    node_bytes_ += BytesOf(in_front);
    for (const SectionPiece& piece : in_front) {
      std::vector<SectionPiece> behind;
      PushDown(*tree_, node.back, piece.polygon, behind);
      for (const SectionPiece& common : behind) {
        ThrowIfStopRequested();
        LeafBorder border{piece.leaf, common.leaf, id, 0, 0, {}};
        border.area_m2 = PolygonArea(common.polygon);
        border.open = Subtract(
            common.polygon,
            node.plane.normal,
            index.Near(common.polygon),
            [&](uint64_t bytes, double share) {
              ChargeWith(bytes, share * static_cast<double>(covers.size()));
            });
        Add(std::move(border));
      }
    }
    done_covers_ += covers.size();
  }

  std::vector<LeafBorder> Take() { return std::move(borders_); }

 private:
  void Add(LeafBorder border) {
    if (border.open.empty()) {
      return;
    }
    for (const Polygon& open : border.open) {
      border.open_m2 += PolygonArea(open);
    }
    border.open.shrink_to_fit();
    open_bytes_ += BytesOf(border.open);
    ChargeWith(0, 0);
    borders_.push_back(std::move(border));
  }

  // Charges what there is, one border more, and so many bytes for a while, of
  // so many covers of the node: pieces grow with covers.
  void ChargeWith(uint64_t more_bytes, double covers) {
    const size_t most = 2 * (borders_.size() + 1);  // it grows
    const double done = static_cast<double>(done_covers_) + covers;
    charge_->GrowTo(
        open_bytes_ + most * sizeof(LeafBorder) + node_bytes_ + more_bytes,
        done / static_cast<double>(std::max<size_t>(all_covers_, 1)));
  }

  const BspTree* tree_;
  size_t all_covers_;
  size_t done_covers_ = 0;  // of the nodes before
  GrowingCharge* charge_;
  std::vector<LeafBorder> borders_;
  uint64_t open_bytes_ = 0;
  uint64_t node_bytes_ = 0;  // while one is looked at
};

}  // namespace

void FaceSurvey::DropCovers() {
  FreeVector(&covers);
  charge.ShrinkTo(patches.capacity() * sizeof(uint32_t) +
                  area_m2.capacity() * sizeof(float));
}

FaceSurvey SurveyFaces(const BlockStorage& store,
                       const BspTree& tree,
                       MemoryBudget& budget) {
  Surveyor surveyor(tree, budget);
  ForEachFace(store, [&surveyor](FaceId, const Face& face) {
    surveyor.Add(face.vertices);
  });
  return surveyor.Finish();
}

uint64_t BytesOf(const std::vector<LeafBorder>& borders) {
  uint64_t bytes = borders.capacity() * sizeof(LeafBorder);
  for (const LeafBorder& border : borders) {
    bytes += BytesOf(border.open);
  }
  return bytes;
}

std::vector<LeafBorder> FindOpenBorders(const BuiltTree& built,
                                        const FaceSurvey& survey,
                                        GrowingCharge& charge) {
  size_t covers = 0;
  for (const std::vector<Polygon>& of_node : survey.covers) {
    covers += of_node.size();
  }
  BorderFinder finder(built.tree, covers, charge);
  for (size_t i = 0; i < built.tree.nodes.size(); ++i) {
    finder.AddNode(NodeId(i), built.sections[i], survey.covers[i]);
  }
  return finder.Take();
}

}  // namespace enfilade
