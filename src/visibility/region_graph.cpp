#include "visibility/region_graph.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace enfilade {
namespace {

constexpr size_t kMostGroups = 12;
// The share of the openings' graph in the memory of visibility, about; the
// cells' graph and the floods follow.
constexpr double kShareOfOpenings = 0.5;

// The class of a doorway: the axis nearest to its normal, and the normal's sign
// along that axis.
size_t DirectionClass(const Doorway& door) {
  if (door.is_sliver) {
    return 6;
  }
  const Vec3 n = door.plane.normal;
  size_t axis = std::abs(n.y) > std::abs(n.x) ? 1 : 0;
  axis = std::abs(n.z) > std::abs(n[axis]) ? 2 : axis;
  return 2 * axis + (n[axis] < 0 ? 1 : 0);
}

// Halves the group at the median of its doorways along its longest axis, and
// returns the upper half.
DoorwayGroup SplitOff(DoorwayGroup& group) {
  const Vec3 extent = BoundsOf(group).Extent();
  size_t axis = extent.y > extent.x ? 1 : 0;
  axis = extent.z > extent[axis] ? 2 : axis;
  std::stable_sort(
      group.begin(), group.end(), [axis](const Doorway* a, const Doorway* b) {
        return a->center[axis] < b->center[axis];
      });
  const auto middle =
      group.begin() + static_cast<std::ptrdiff_t>(group.size() / 2);
  DoorwayGroup half(middle, group.end());
  group.erase(middle, group.end());
  return half;
}

}  // namespace

Box3 BoundsOf(const DoorwayGroup& group) {
  Box3 bounds;
  for (const Doorway* door : group) {
    for (size_t i = 0; i < door->polygon.Size(); ++i) {
      bounds.Include(door->polygon[i]);
    }
  }
  return bounds;
}

std::vector<DoorwayGroup> GroupDoorways(const DoorwayGroup& doorways) {
  std::array<DoorwayGroup, 7> by_direction;
  for (const Doorway* door : doorways) {
    by_direction[DirectionClass(*door)].push_back(door);
  }
  std::vector<DoorwayGroup> groups;
  for (DoorwayGroup& group : by_direction) {
    if (!group.empty()) {
      groups.push_back(std::move(group));
    }
  }
  const auto size = [](const DoorwayGroup& group) {
    return group.size() < 2 ? 0 : Length(BoundsOf(group).Extent());
  };
  while (groups.size() < kMostGroups) {
    const auto largest =
        std::max_element(groups.begin(),
                         groups.end(),
                         [&](const DoorwayGroup& a, const DoorwayGroup& b) {
                           return size(a) < size(b);
                         });
    if (largest == groups.end() || largest->size() < 2) {
      break;
    }
    DoorwayGroup half = SplitOff(*largest);
    groups.push_back(std::move(half));
  }
  std::stable_sort(groups.begin(),
                   groups.end(),
                   [](const DoorwayGroup& a, const DoorwayGroup& b) {
                     return a.size() > b.size();
                   });
  return groups;
}

RegionGraph::RegionGraph(size_t cells,
                         std::vector<CellId> cell_of,
                         const PortalSource& openings,
                         MemoryBudget& budget)
    : charge_(
          budget,
          cell_of.size() * 3 * sizeof(CellId) +
              cells * (sizeof(std::vector<CellId>) + kAllocationHeaderBytes),
          "the convex regions of the building"),
      graph_(cell_of.size(), openings, budget, kShareOfOpenings),
      cell_of_(std::move(cell_of)),
      regions_(cells) {
  for (size_t i = 0; i < cell_of_.size(); ++i) {
    regions_[cell_of_[i].Index()].emplace_back(i);
  }
}

DoorwayGroup RegionGraph::DoorwaysOut(CellId cell) const {
  DoorwayGroup out;
  for (const CellId region : regions_[cell.Index()]) {
    for (const Doorway& door : graph_.Doorways(region)) {
      if (CellOf(door.to) != cell) {
        out.push_back(&door);
      }
    }
  }
  return out;
}

}  // namespace enfilade
