#include "visibility/beam_flood.h"

#include "partition/polygon.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

namespace enfilade {
namespace {

constexpr uint32_t kNone = std::numeric_limits<uint32_t>::max();
constexpr size_t kMostGroups = 12;
constexpr size_t kMostSourcePoints = 8;
// Doorways looked at by one flood, at most.
constexpr uint64_t kMostTests = 300'000;
// A doorway's reached part grows so often before it is taken for the whole.
constexpr uint32_t kMostGrowths = 4;
constexpr double kLeastEdgeMetres = 1e-7;
// A plane holds the source behind it up to rounding.
constexpr double kBehindMetres = 1e-9;
// and rises at least so steeply over the doorway: a plane along the doorway
// says nothing.
constexpr double kLeastSlope = 1e-3;

Box3 BoundsOf(const DoorwayGroup& group) {
  Box3 bounds;
  for (const Doorway* door : group) {
    for (const Point3 p : door->polygon) {
      bounds.Include(p);
    }
  }
  return bounds;
}

std::vector<Point3> CornersOf(const Box3& box) {
  std::vector<Point3> corners;
  for (const double x : {box.low.x, box.high.x}) {
    for (const double y : {box.low.y, box.high.y}) {
      for (const double z : {box.low.z, box.high.z}) {
        corners.push_back({x, y, z});
      }
    }
  }
  return corners;
}

// By the axis that is nearest to the doorway's normal, and its sign.
size_t DirectionClass(const Doorway& door) {
  if (door.is_sliver) {
    return 6;
  }
  const Vec3 n = door.plane.normal;
  size_t axis = std::abs(n.y) > std::abs(n.x) ? 1 : 0;
  axis = std::abs(n.z) > std::abs(n[axis]) ? 2 : axis;
  return 2 * axis + (n[axis] < 0 ? 1 : 0);
}

// Halves the group at the median of its doorways along its longest axis.
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

// The plane through the edge that has the source behind it and `inward` before
// it, touching the source; nullopt if there is none.
std::optional<DoorPlane> Support(Point3 from,
                                 Vec3 along,
                                 Vec3 inward,
                                 const std::vector<Point3>& source) {
  const auto through = [&](Point3 s) -> std::optional<DoorPlane> {
    Vec3 normal = Cross(along, s - from);
    const double length = Length(normal);
    if (length < kLeastEdgeMetres) {
      return std::nullopt;
    }
    normal = normal / (Dot(normal, inward) < 0 ? -length : length);
    return DoorPlane{normal, Dot(normal, from - Point3{})};
  };
  std::optional<DoorPlane> plane;
  for (const Point3 s : source) {
    if (!plane || plane->Beyond(s) > kBehindMetres) {
      plane = through(s);
    }
  }
  const bool holds = plane && Dot(plane->normal, inward) > kLeastSlope &&
                     std::all_of(source.begin(), source.end(), [&](Point3 s) {
                       return plane->Beyond(s) <= kBehindMetres;
                     });
  return holds ? plane : std::nullopt;
}

bool IsWithin(const std::vector<Point3>& inner,
              const std::vector<Point3>& outer,
              Vec3 normal) {
  for (size_t i = 0; i < outer.size(); ++i) {
    const Point3 a = outer[i];
    const Vec3 edge = outer[(i + 1) % outer.size()] - a;
    const double length = Length(edge);
    if (length < kLeastEdgeMetres) {
      continue;
    }
    const Vec3 inward = Cross(normal, edge) / length;
    for (const Point3 p : inner) {
      if (Dot(inward, p - a) < -kStabToleranceMetres) {
        return false;
      }
    }
  }
  return true;
}

}  // namespace

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

RegionGraph::RegionGraph(size_t cells, const Regions& regions)
    : graph_(regions.cell_of.size(), regions.openings),
      cell_of_(regions.cell_of),
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

BeamFlood::BeamFlood(const RegionGraph& regions)
    : regions_(&regions), node_of_(regions.Graph().DoorwayCount(), kNone) {}

void BeamFlood::Begin(const DoorwayGroup& firsts) {
  for (const Node& node : nodes_) {
    node_of_[node.door->index] = kNone;
  }
  nodes_.clear();
  waiting_.clear();
  source_.clear();
  for (const Doorway* first : firsts) {
    source_.insert(source_.end(), first->polygon.begin(), first->polygon.end());
  }
  if (source_.size() > kMostSourcePoints) {
    source_ = CornersOf(BoundsOf(firsts));
  }
}

void BeamFlood::Reach(const Doorway& door, std::vector<Point3> region) {
  uint32_t& number = node_of_[door.index];
  if (number == kNone) {
    number = static_cast<uint32_t>(nodes_.size());
    nodes_.push_back({&door, std::move(region), 0, door.is_sliver, true});
    waiting_.push_back(number);
    return;
  }
  Node& node = nodes_[number];
  if (node.is_whole || IsWithin(region, node.region, door.plane.normal)) {
    return;
  }
  region.insert(region.end(), node.region.begin(), node.region.end());
  node.region = ConvexHull(region, door.plane.normal);
  node.is_whole = node.region.size() < 3 || ++node.growths >= kMostGrowths;
  if (node.is_whole) {
    node.region = door.polygon;
  }
  if (!std::exchange(node.is_waiting, true)) {
    waiting_.push_back(number);
  }
}

std::vector<DoorPlane> BeamFlood::BeamThrough(const Node& node) const {
  std::vector<DoorPlane> beam;
  const Doorway& door = *node.door;
  if (door.is_sliver) {
    return beam;
  }
  beam.push_back(door.plane);
  const size_t n = node.region.size();
  for (size_t i = 0; i < n; ++i) {
    const Point3 a = node.region[i];
    const Vec3 edge = node.region[(i + 1) % n] - a;
    const double length = Length(edge);
    if (length < kLeastEdgeMetres) {
      continue;
    }
    const Vec3 along = edge / length;
    const Vec3 inward = Cross(door.plane.normal, along);
    const Point3 from = a - inward * kStabToleranceMetres;
    if (const auto plane = Support(from, along, inward, source_)) {
      beam.push_back(*plane);
    }
  }
  return beam;
}

bool BeamFlood::IsWhole(const Doorway& door) const {
  const uint32_t number = node_of_[door.index];
  return number != kNone && nodes_[number].is_whole;
}

bool BeamFlood::FindPart(const Node& node,
                         const std::vector<DoorPlane>& beam,
                         const Doorway& next) {
  const double reach = next.radius + kStabToleranceMetres;
  for (const DoorPlane& plane : beam) {
    if (plane.Beyond(next.center) < -reach) {
      return false;
    }
  }
  if (next.portal == node.door->portal ||
      (!next.is_sliver && (!ReachesBefore(node.region, next.plane) ||
                           !ReachesBefore(source_, next.plane)))) {
    return false;
  }
  part_ = next.polygon;
  for (const DoorPlane& plane : beam) {
    ClipBeyondInto(part_, plane, clipped_);
    part_.swap(clipped_);
    if (part_.empty()) {
      return false;
    }
  }
  return true;
}

bool BeamFlood::Run(const DoorwayGroup& firsts, std::vector<bool>& reached) {
  Begin(firsts);
  for (const Doorway* first : firsts) {
    Reach(*first, first->polygon);
    nodes_[node_of_[first->index]].is_whole = true;
  }
  uint64_t tests = 0;
  for (size_t i = 0; i < waiting_.size(); ++i) {
    const uint32_t number = waiting_[i];
    nodes_[number].is_waiting = false;
    const Node node = nodes_[number];
    reached[regions_->CellOf(node.door->to).Index()] = true;
    const std::vector<DoorPlane> beam = BeamThrough(node);
    const auto& doors = regions_->Graph().Doorways(node.door->to);
    tests += doors.size();
    if (tests > kMostTests) {
      reached.assign(reached.size(), true);
      return false;
    }
    for (const Doorway& next : doors) {
      if (!IsWhole(next) && FindPart(node, beam, next)) {
        Reach(next, next.is_sliver ? next.polygon : part_);
      }
    }
  }
  return true;
}

}  // namespace enfilade
