#include "partition/bsp_builder.h"

#include "base/stop.h"
#include "partition/split_choice.h"

#include <string_view>
#include <utility>

namespace enfilade {
namespace {

struct Halves {
  std::vector<WallFragment> front;
  std::vector<WallFragment> back;
};

void AddIfAny(uint32_t face,
              Polygon polygon,
              std::vector<WallFragment>& fragments) {
  if (polygon.size() >= 3 && PolygonArea(polygon) > kLeastAreaM2) {
    fragments.push_back({face, std::move(polygon)});
  }
}

// What lies in the plane itself is done: it bounds both halves.
Halves Divide(std::vector<WallFragment> fragments, const Plane& plane) {
  Halves halves;
  for (WallFragment& fragment : fragments) {
    switch (Classify(fragment.polygon, plane, kOnPlaneM)) {
      case PlaneSide::kOn:
        break;
      case PlaneSide::kFront:
        halves.front.push_back(std::move(fragment));
        break;
      case PlaneSide::kBack:
        halves.back.push_back(std::move(fragment));
        break;
      case PlaneSide::kCut: {
        SplitPolygons parts = Split(fragment.polygon, plane, kOnPlaneM);
        AddIfAny(fragment.face, std::move(parts.front), halves.front);
        AddIfAny(fragment.face, std::move(parts.back), halves.back);
        break;
      }
    }
  }
  return halves;
}

uint64_t BytesOf(const Polygon& polygon) {
  return kAllocationHeaderBytes + polygon.capacity() * sizeof(Point3);
}

uint64_t BytesOf(const std::vector<WallFragment>& fragments) {
  uint64_t bytes = fragments.capacity() * sizeof(WallFragment);
  for (const WallFragment& fragment : fragments) {
    bytes += BytesOf(fragment.polygon);
  }
  return bytes;
}

// What Divide takes beside the fragments: two vectors that grow, and both parts
// of what is cut.
uint64_t BytesToDivide(const std::vector<WallFragment>& fragments,
                       const Plane& plane) {
  constexpr size_t kMostMoreCorners = 4;  // of both parts
  uint64_t bytes = 3 * fragments.size() * sizeof(WallFragment);
  for (const WallFragment& fragment : fragments) {
    if (Classify(fragment.polygon, plane, kOnPlaneM) == PlaneSide::kCut) {
      bytes +=
          2 * kAllocationHeaderBytes +
          2 * (fragment.polygon.size() + kMostMoreCorners) * sizeof(Point3);
    }
  }
  return bytes;
}

// What ChooseSplit takes: each fragment may be a group of its own.
uint64_t BytesToChoose(const std::vector<WallFragment>& fragments) {
  constexpr uint64_t kBytesPerGroup = 144;
  return fragments.size() * kBytesPerGroup;
}

class TreeBuilder {
 public:
  TreeBuilder(const WallFaces& walls, MemoryBudget& budget)
      : walls_(&walls), budget_(&budget), charge_(budget, kWhat) {}

  // Charges, before there are any, the fragments of all faces.
  void ChargeFaces() {
    uint64_t bytes = walls_->faces.size() * sizeof(WallFragment);
    for (const WallFace& face : walls_->faces) {
      bytes += BytesOf(face.polygon);
    }
    charge_.GrowTo(bytes);
  }

  BspChild Build(const ConvexRegion& region,
                 std::vector<WallFragment> fragments) {
    ThrowIfStopRequested();
    const uint64_t own_bytes = BytesOf(fragments);
    waiting_bytes_ += own_bytes;
    ChargeWith(BytesToChoose(fragments));
    const auto plane = ChooseSplit(region, fragments, *walls_);
    if (!plane) {
      waiting_bytes_ -= own_bytes;
      return AddLeaf(region);
    }
    ChargeWith(BytesToDivide(fragments, *plane));
    const NodeId id = AddNode(*plane, region.CrossSection(*plane));
    Halves halves = Divide(std::move(fragments), *plane);
    waiting_bytes_ -= own_bytes;
    const uint64_t back_bytes = BytesOf(halves.back);
    waiting_bytes_ += back_bytes;
    const ConvexRegion::Halves parts = region.Cut(*plane);
    const BspChild front = Build(parts.front, std::move(halves.front));
    waiting_bytes_ -= back_bytes;
    const BspChild back = Build(parts.back, std::move(halves.back));
    built_.tree.nodes[id.Index()].front = front;
    built_.tree.nodes[id.Index()].back = back;
    return BspChild(id);
  }

  BuiltTree Finish(const Box3& box, BspChild root) {
    built_.tree.box = box;
    built_.tree.root = root;
    built_.tree.leaf_count = static_cast<uint32_t>(built_.leaves.size());
    charge_.ShrinkTo(0);
    built_.charge = MemoryCharge(*budget_, BytesOf(built_), kWhat);
    return std::move(built_);
  }

 private:
  static constexpr std::string_view kWhat = "the walls while cells are found";
  static constexpr uint64_t kGrowth = 2;  // of vectors

  BspChild AddLeaf(const ConvexRegion& region) {
    built_.leaves.push_back(ShapeOf(region));
    built_bytes_ +=
        kGrowth * sizeof(LeafShape) + BytesOf(built_.leaves.back().corners);
    return BspChild(LeafId(built_.leaves.size() - 1));
  }

  NodeId AddNode(const Plane& plane, Polygon section) {
    const NodeId id(built_.tree.nodes.size());
    built_.tree.nodes.push_back({plane, {}, {}});
    built_bytes_ +=
        kGrowth * (sizeof(BspNode) + sizeof(Polygon)) + BytesOf(section);
    built_.sections.push_back(std::move(section));
    return id;
  }

  // Charges what there is and so many bytes for a while.
  void ChargeWith(uint64_t more_bytes) {
    charge_.GrowTo(built_bytes_ + waiting_bytes_ + more_bytes);
  }

  const WallFaces* walls_;
  MemoryBudget* budget_;
  BuiltTree built_;
  uint64_t built_bytes_ = 0;
  uint64_t waiting_bytes_ = 0;  // fragments, of regions that are not done
  GrowingCharge charge_;
};

}  // namespace

LeafShape ShapeOf(const ConvexRegion& region) {
  return {region.Corners(), region.Bounds(), region.Center(), region.Volume()};
}

uint64_t BytesOf(const BuiltTree& built) {
  uint64_t bytes = built.tree.nodes.capacity() * sizeof(BspNode) +
                   built.sections.capacity() * sizeof(Polygon) +
                   built.leaves.capacity() * sizeof(LeafShape);
  for (const Polygon& section : built.sections) {
    bytes += BytesOf(section);
  }
  for (const LeafShape& leaf : built.leaves) {
    bytes += BytesOf(leaf.corners);
  }
  return bytes;
}

BuiltTree BuildTree(const Box3& box,
                    const WallFaces& walls,
                    MemoryBudget& budget) {
  TreeBuilder builder(walls, budget);
  builder.ChargeFaces();
  std::vector<WallFragment> fragments;
  fragments.reserve(walls.faces.size());
  for (uint32_t i = 0; i < walls.faces.size(); ++i) {
    fragments.push_back({i, walls.faces[i].polygon});
  }
  const BspChild root = builder.Build(ConvexRegion(box), std::move(fragments));
  return builder.Finish(box, root);
}

}  // namespace enfilade
