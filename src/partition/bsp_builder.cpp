#include "partition/bsp_builder.h"

#include "partition/split_choice.h"

#include <algorithm>
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

class TreeBuilder {
 public:
  explicit TreeBuilder(const WallFaces& walls) : walls_(&walls) {}

  BspChild Build(const ConvexRegion& region,
                 std::vector<WallFragment> fragments) {
    const auto plane = ChooseSplit(region, fragments, *walls_);
    if (!plane) {
      built_.leaves.push_back(ShapeOf(region));
      return BspChild(LeafId(built_.leaves.size() - 1));
    }
    const NodeId id(built_.tree.nodes.size());
    built_.tree.nodes.push_back({*plane, {}, {}});
    built_.sections.push_back(region.CrossSection(*plane));
    Halves halves = Divide(std::move(fragments), *plane);
    const ConvexRegion::Halves parts = region.Cut(*plane);
    const BspChild front = Build(parts.front, std::move(halves.front));
    const BspChild back = Build(parts.back, std::move(halves.back));
    built_.tree.nodes[id.Index()].front = front;
    built_.tree.nodes[id.Index()].back = back;
    return BspChild(id);
  }

  BuiltTree Finish(const Box3& box, BspChild root) {
    built_.tree.box = box;
    built_.tree.root = root;
    built_.tree.leaf_count = static_cast<uint32_t>(built_.leaves.size());
    return std::move(built_);
  }

 private:
  const WallFaces* walls_;
  BuiltTree built_;
};

}  // namespace

LeafShape ShapeOf(const ConvexRegion& region) {
  return {region.Corners(), region.Bounds(), region.Center(), region.Volume()};
}

BuiltTree BuildTree(const Box3& box, const WallFaces& walls) {
  std::vector<WallFragment> fragments;
  fragments.reserve(walls.faces.size());
  for (uint32_t i = 0; i < walls.faces.size(); ++i) {
    fragments.push_back({i, walls.faces[i].polygon});
  }
  TreeBuilder builder(walls);
  const BspChild root = builder.Build(ConvexRegion(box), std::move(fragments));
  return builder.Finish(box, root);
}

}  // namespace enfilade
