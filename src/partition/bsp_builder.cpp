#include "partition/bsp_builder.h"

#include "base/stop.h"
#include "partition/split_choice.h"

#include <string_view>
#include <utility>

namespace enfilade {
namespace {

struct Halves {
  FragmentList front;
  FragmentList back;
};

// Divides the fragments between the two sides of the plane and drops those that
// lie in the plane: they bound both halves.
Halves Divide(FragmentList fragments, const Plane& plane, ScratchShelf& shelf) {
  Halves halves{FragmentList(shelf), FragmentList(shelf)};
  fragments.Consume([&](const WallFragment& fragment) {
    const auto add_part = [&fragment](Polygon part, FragmentList& half) {
      if (part.size() >= 3 && PolygonArea(part) > kLeastAreaM2) {
        half.Add({std::move(part), fragment.plane, fragment.plane_group});
      }
    };
    switch (Classify(fragment.polygon, plane, kOnPlaneM)) {
      case PlaneSide::kOn:
        break;
      case PlaneSide::kFront:
        halves.front.Add(fragment);
        break;
      case PlaneSide::kBack:
        halves.back.Add(fragment);
        break;
      case PlaneSide::kCut: {
        SplitPolygons parts = Split(fragment.polygon, plane, kOnPlaneM);
        add_part(std::move(parts.front), halves.front);
        add_part(std::move(parts.back), halves.back);
        break;
      }
    }
  });
  return halves;
}

uint64_t BytesOf(const Polygon& polygon) {
  return kAllocationHeaderBytes + polygon.capacity() * sizeof(Point3);
}

class TreeBuilder {
 public:
  TreeBuilder(const WallRules& rules, ScratchShelf& shelf, MemoryBudget& budget)
      : rules_(&rules),
        shelf_(&shelf),
        budget_(&budget),
        charge_(budget, kWhat) {}

  // Gives the region back as soon as it is divided: among the many facets of a
  // round hall every division cuts off one more wedge, and only the wedges wait
  // on the way down.
  BspChild Build(ConvexRegion region, FragmentList fragments) {
    ThrowIfStopRequested();
    const auto plane = ChooseSplit(region, fragments, *rules_, *budget_);
    if (!plane) {
      return AddLeaf(region);
    }
    const NodeId id = AddNode(*plane, region.CrossSection(*plane));
    Halves halves = Divide(std::move(fragments), *plane, *shelf_);
    ConvexRegion::Halves parts = region.Cut(*plane);
    region = {};
    const MemoryCharge waiting(
        *budget_, parts.front.FacetBytes() + parts.back.FacetBytes(), kWhat);
    const BspChild front =
        Build(std::move(parts.front), std::move(halves.front));
    const BspChild back = Build(std::move(parts.back), std::move(halves.back));
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
  static constexpr std::string_view kWhat = "the tree of splitting planes";
  static constexpr uint64_t kGrowth = 2;  // vector of nodes while it grows

  BspChild AddLeaf(const ConvexRegion& region) {
    built_.leaves.push_back(ShapeOf(region));
    built_bytes_ += sizeof(LeafShape) + BytesOf(built_.leaves.back().corners);
    charge_.GrowTo(built_bytes_);
    return BspChild(LeafId(built_.leaves.size() - 1));
  }

  NodeId AddNode(const Plane& plane, Polygon section) {
    const NodeId id(built_.tree.nodes.size());
    built_.tree.nodes.push_back({plane, {}, {}});
    built_bytes_ +=
        kGrowth * sizeof(BspNode) + sizeof(Polygon) + BytesOf(section);
    built_.sections.push_back(std::move(section));
    charge_.GrowTo(built_bytes_);
    return id;
  }

  const WallRules* rules_;
  ScratchShelf* shelf_;
  MemoryBudget* budget_;
  BuiltTree built_;
  uint64_t built_bytes_ = 0;
  GrowingCharge charge_;
};

}  // namespace

LeafShape ShapeOf(const ConvexRegion& region) {
  return {region.Corners(),
          region.Bounds(),
          region.Center(),
          region.Volume(),
          region.LeastWidth()};
}

uint64_t BytesOf(const BuiltTree& built) {
  uint64_t bytes = built.tree.nodes.capacity() * sizeof(BspNode) +
                   built.sections.size() * sizeof(Polygon) +
                   built.leaves.size() * sizeof(LeafShape);
  for (const Polygon& section : built.sections) {
    bytes += BytesOf(section);
  }
  for (const LeafShape& leaf : built.leaves) {
    bytes += BytesOf(leaf.corners);
  }
  return bytes;
}

BuiltTree BuildTree(const Box3& box,
                    Walls walls,
                    ScratchShelf& shelf,
                    MemoryBudget& budget) {
  TreeBuilder builder(walls.rules, shelf, budget);
  const BspChild root =
      builder.Build(ConvexRegion(box), std::move(walls.fragments));
  return builder.Finish(box, root);
}

}  // namespace enfilade
