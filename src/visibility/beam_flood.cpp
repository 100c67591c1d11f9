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
// Doorways looked at by one flood, and reached by it, at most.
constexpr uint64_t kMostTests = 5'000'000;
constexpr size_t kMostNodes = 30'000;
constexpr uint64_t kNodeBytes = 256;  // with its part of the doorway
// A doorway's reached part grows so often before it is taken for the whole.
constexpr uint32_t kMostGrowths = 16;
// Dominators that a beam is held to, at most.
constexpr size_t kMostPassed = 8;
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

// From the box to the point, m; 0 inside of it.
double Distance(const Box3& box, Point3 p) {
  double square = 0;
  for (size_t axis = 0; axis < 3; ++axis) {
    const double gap =
        std::max({0.0, box.low[axis] - p[axis], p[axis] - box.high[axis]});
    square += gap * gap;
  }
  return std::sqrt(square);
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

// Appends the planes through the region's edges that hold what lines that come
// through all of `source` can reach beyond it.
void AppendSupports(const std::vector<Point3>& region,
                    Vec3 normal,
                    const std::vector<Point3>& source,
                    std::vector<DoorPlane>* planes) {
  const size_t n = region.size();
  for (size_t i = 0; i < n; ++i) {
    const Point3 a = region[i];
    const Vec3 edge = region[(i + 1) % n] - a;
    const double length = Length(edge);
    if (length < kLeastEdgeMetres) {
      continue;
    }
    const Vec3 along = edge / length;
    const Vec3 inward = Cross(normal, along);
    const Point3 from = a - inward * kStabToleranceMetres;
    if (const auto plane = Support(from, along, inward, source)) {
      planes->push_back(*plane);
    }
  }
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

uint64_t BeamFlood::MostBytes(const RegionGraph& regions) {
  const size_t doorways = regions.Graph().DoorwayCount();
  return doorways * sizeof(uint32_t) +
         std::min(doorways, kMostNodes) * kNodeBytes;
}

void BeamFlood::Begin(const DoorwayGroup& firsts) {
  for (const Node& node : nodes_) {
    node_of_[node.door->index] = kNone;
  }
  nodes_.clear();
  waiting_.clear();
  source_.clear();
  source_bounds_ = BoundsOf(firsts);
  for (const Doorway* first : firsts) {
    source_.insert(source_.end(), first->polygon.begin(), first->polygon.end());
  }
  if (source_.size() > kMostSourcePoints) {
    source_ = CornersOf(source_bounds_);
  }
}

void BeamFlood::Wait(uint32_t number) {
  if (!std::exchange(nodes_[number].is_waiting, true)) {
    waiting_.push_back(
        {Distance(source_bounds_, nodes_[number].door->center), number});
    std::push_heap(waiting_.begin(), waiting_.end());
  }
}

uint32_t BeamFlood::TakeNearest() {
  std::pop_heap(waiting_.begin(), waiting_.end());
  const uint32_t number = waiting_.back().node;
  waiting_.pop_back();
  nodes_[number].is_waiting = false;
  return number;
}

void BeamFlood::Reach(const Doorway& door,
                      std::vector<Point3> region,
                      uint32_t from) {
  uint32_t& number = node_of_[door.index];
  if (number == kNone) {
    number = static_cast<uint32_t>(nodes_.size());
    nodes_.push_back({&door, std::move(region), from});
    Wait(number);
    return;
  }
  Node& node = nodes_[number];
  const uint32_t dominator = CommonDominator(node.dominator, from);
  const bool grows =
      !door.is_sliver && !IsWithin(region, node.region, door.plane.normal);
  const bool moves = dominator != node.dominator;
  node.dominator = dominator;
  if (!grows && !moves && !IsOutdated(node)) {
    return;
  }
  if (grows || moves) {
    node.changed_at = ++clock_;
  }
  if (grows) {
    region.insert(region.end(), node.region.begin(), node.region.end());
    node.region = ConvexHull(region, door.plane.normal);
    if (node.region.size() < 3 || ++node.growths >= kMostGrowths) {
      node.region = door.polygon;
    }
  }
  Wait(number);
}

bool BeamFlood::IsOutdated(const Node& node) const {
  for (uint32_t n = node.dominator; n != kNone; n = nodes_[n].dominator) {
    if (nodes_[n].changed_at > node.passed_at) {
      return true;
    }
  }
  return false;
}

uint32_t BeamFlood::CommonDominator(uint32_t a, uint32_t b) const {
  const auto depth = [this](uint32_t n) {
    uint32_t count = 0;
    for (; n != kNone; n = nodes_[n].dominator) {
      ++count;
    }
    return count;
  };
  uint32_t depth_a = depth(a);
  uint32_t depth_b = depth(b);
  while (a != b) {
    if (depth_a >= depth_b) {
      a = nodes_[a].dominator;
      --depth_a;
    } else {
      b = nodes_[b].dominator;
      --depth_b;
    }
  }
  return a;
}

bool BeamFlood::IsFirst(const Doorway& door) const {
  const uint32_t number = node_of_[door.index];
  return number != kNone && nodes_[number].is_first;
}

bool BeamFlood::CanPass(const Node& passed,
                        std::span<const DoorPlane> planes,
                        const Doorway& next) {
  return next.portal != passed.door->portal &&
         std::all_of(planes.begin(),
                     planes.end(),
                     [&](const DoorPlane& plane) {
                       return plane.Beyond(next.center) >=
                              -next.radius - kStabToleranceMetres;
                     }) &&
         (next.is_sliver || ReachesBefore(passed.region, next.plane)) &&
         (passed.door->is_sliver ||
          ReachesBeyond(next.polygon, passed.door->plane));
}

void BeamFlood::LookThrough(uint32_t number) {
  planes_.clear();
  ahead_.clear();
  const Node& last = nodes_[number];
  const Vec3 last_normal = last.door->plane.normal;
  for (const Doorway& next : regions_->Graph().Doorways(last.door->to)) {
    if (!IsFirst(next)) {
      ahead_.push_back(&next);
    }
  }
  size_t passed = 0;
  for (uint32_t n = number;
       n != kNone && passed < kMostPassed && !ahead_.empty();
       n = nodes_[n].dominator) {
    const Node& node = nodes_[n];
    const size_t planes_before = planes_.size();
    if (!node.door->is_sliver) {
      planes_.push_back(node.door->plane);
      AppendSupports(node.region, node.door->plane.normal, source_, &planes_);
    }
    if (n != number && !last.door->is_sliver) {
      AppendSupports(last.region, last_normal, node.region, &planes_);
    }
    const std::span planes = std::span(planes_).subspan(planes_before);
    std::erase_if(ahead_, [&](const Doorway* next) {
      return !CanPass(node, planes, *next);
    });
    ++passed;
  }
  std::erase_if(ahead_, [&](const Doorway* next) {
    return !next->is_sliver && !ReachesBefore(source_, next->plane);
  });
}

bool BeamFlood::FindPart(const Doorway& next) {
  part_ = next.polygon;
  for (const DoorPlane& plane : planes_) {
    if (plane.Beyond(next.center) > next.radius) {
      continue;  // holds all of it
    }
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
    Reach(*first, first->polygon, kNone);
    nodes_.back().is_first = true;
  }
  uint64_t tests = 0;
  while (!waiting_.empty()) {
    const uint32_t number = TakeNearest();
    nodes_[number].passed_at = ++clock_;
    const Doorway& door = *nodes_[number].door;
    reached[regions_->CellOf(door.to).Index()] = true;
    tests += regions_->Graph().Doorways(door.to).size();
    if (tests > kMostTests || nodes_.size() > kMostNodes) {
      reached.assign(reached.size(), true);
      return false;
    }
    LookThrough(number);
    for (const Doorway* next : ahead_) {
      if (FindPart(*next)) {
        Reach(*next, next->is_sliver ? next->polygon : part_, number);
      }
    }
  }
  return true;
}

}  // namespace enfilade
