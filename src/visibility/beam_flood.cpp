#include "visibility/beam_flood.h"

#include "base/stop.h"
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
constexpr size_t kMostSourcePoints = 8;
// The most doorways that one flood tests, and the most that it reaches.
constexpr uint64_t kMostTests = 5'000'000;
constexpr size_t kMostNodes = 30'000;
constexpr uint64_t kNodeBytes = 272;  // including its part of the doorway
// The most planes that are kept for doorways, also per doorway of the building.
constexpr size_t kMostKeptPlanes = 32'768;
constexpr size_t kKeptPlanesPerDoorway = 8;
// After this many growths, the reached part of a doorway is taken for the whole
// doorway.
constexpr uint32_t kMostGrowths = 16;
// The most nodes that hold a beam: the node itself and its nearest dominators.
constexpr size_t kMostPassed = 8;
// A supporting plane has the source behind it, up to this rounding error.
constexpr double kBehindMetres = 1e-9;
// The least cosine between the normal of a supporting plane and the inward
// direction: a plane along the doorway says nothing.
constexpr double kLeastSlope = 1e-3;
// Each plane cuts the box of a cell this many times, because what a plane cuts
// off along one axis depends on what other planes have cut off along the
// others.
constexpr int kPassesOfPart = 2;

size_t MostKeptPlanes(size_t doorways) {
  return std::min(kMostKeptPlanes, kKeptPlanesPerDoorway * doorways);
}

// The distance from the box to the point, m; 0 inside the box.
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

// The plane through the edge (from, along) that touches the source and has the
// whole source behind it, while `inward` points beyond it; nullopt if there is
// none.
std::optional<Plane> Support(Point3 from,
                             Vec3 along,
                             Vec3 inward,
                             const std::vector<Point3>& source) {
  const auto through = [&](Point3 s) -> std::optional<Vec3> {
    const Vec3 normal = Cross(along, s - from);
    const double length = Length(normal);
    if (length < kLeastEdgeMetres) {
      return std::nullopt;
    }
    return normal / (Dot(normal, inward) < 0 ? -length : length);
  };
  // Seen from the edge, not from the origin, which may be far away.
  const auto is_behind = [&](Vec3 normal, Point3 s) {
    return Dot(normal, s - from) <= kBehindMetres;
  };
  std::optional<Vec3> normal;
  auto touched = source.begin();
  for (auto s = source.begin(); s != source.end(); ++s) {
    if (!normal || !is_behind(*normal, *s)) {
      normal = through(*s);
      touched = s;
    }
  }
  // Points after the touched one were found behind its plane.
  const bool holds = normal && Dot(*normal, inward) > kLeastSlope &&
                     std::all_of(source.begin(), touched, [&](Point3 s) {
                       return is_behind(*normal, s);
                     });
  return holds ? std::optional(Plane{*normal, Dot(*normal, from - Point3{})})
               : std::nullopt;
}

// Appends planes through the edges of the region. Lines that come from `source`
// through the region reach only what lies beyond all these planes.
void AppendSupports(const std::vector<Point3>& region,
                    Vec3 normal,
                    const std::vector<Point3>& source,
                    std::vector<Plane>* planes) {
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

// Shrinks the box along each axis by as much as the plane alone allows.
void Tighten(const Plane& plane, Box3* box) {
  const Vec3 n = plane.normal;
  const Point3 far = {n.x > 0 ? box->high.x : box->low.x,
                      n.y > 0 ? box->high.y : box->low.y,
                      n.z > 0 ? box->high.z : box->low.z};
  // The depth of the box's farthest corner beyond the plane.
  const double depth = plane.Distance(far) + kStabToleranceMetres;
  const auto cut = [depth](
                       double slope, double from, double* low, double* high) {
    if (slope > kLeastSlope) {
      *low = std::max(*low, from - depth / slope);
    } else if (slope < -kLeastSlope) {
      *high = std::min(*high, from - depth / slope);
    }
  };
  cut(n.x, far.x, &box->low.x, &box->high.x);
  cut(n.y, far.y, &box->low.y, &box->high.y);
  cut(n.z, far.z, &box->low.z, &box->high.z);
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

BeamFlood::BeamFlood(const RegionGraph& regions)
    : regions_(&regions),
      node_of_(regions.Graph().DoorwayCount(), kNone),
      most_kept_planes_(MostKeptPlanes(regions.Graph().DoorwayCount())) {
  kept_planes_.reserve(most_kept_planes_);
}

uint64_t BeamFlood::MostBytes(const RegionGraph& regions) {
  const size_t doorways = regions.Graph().DoorwayCount();
  return doorways * sizeof(uint32_t) +
         std::min(doorways, kMostNodes) * kNodeBytes +
         MostKeptPlanes(doorways) * sizeof(Plane);
}

void BeamFlood::Begin(const DoorwayGroup& firsts) {
  for (const Node& node : nodes_) {
    node_of_[node.door->index] = kNone;
  }
  nodes_.clear();
  waiting_.clear();
  ForgetPlanes();
  source_.clear();
  source_bounds_ = BoundsOf(firsts);
  for (const Doorway* first : firsts) {
    first->polygon.CopyTo(source_);
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
      node.region = door.polygon.Copy();
    }
    node.kept = {};
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
                        std::span<const Plane> planes,
                        const Doorway& next) {
  return next.portal != passed.door->portal &&
         std::all_of(planes.begin(),
                     planes.end(),
                     [&](const Plane& plane) {
                       return plane.Distance(next.center) >=
                              -next.radius - kStabToleranceMetres;
                     }) &&
         (next.is_sliver || ReachesBefore(passed.region, next.plane)) &&
         (passed.door->is_sliver ||
          ReachesBeyond(next.polygon, passed.door->plane));
}

// Planes beyond which lines from the source through the node's region reach.
// They are kept until the region grows or there is no room for more.
std::span<const Plane> BeamFlood::SupportsOf(uint32_t number) {
  Node& node = nodes_[number];
  if (node.kept.epoch != epoch_) {
    if (kept_planes_.size() + node.region.size() > most_kept_planes_) {
      ForgetPlanes();
    }
    const size_t first = kept_planes_.size();
    AppendSupports(
        node.region, node.door->plane.normal, source_, &kept_planes_);
    node.kept = {epoch_, first, kept_planes_.size() - first};
  }
  return std::span(kept_planes_).subspan(node.kept.first, node.kept.count);
}

void BeamFlood::ForgetPlanes() {
  kept_planes_.clear();
  ++epoch_;
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
  for (uint32_t n = number; n != kNone && passed < kMostPassed;
       n = nodes_[n].dominator) {
    const Node& node = nodes_[n];
    const size_t planes_before = planes_.size();
    if (!node.door->is_sliver) {
      planes_.push_back(node.door->plane);
      const std::span supports = SupportsOf(n);
      planes_.insert(planes_.end(), supports.begin(), supports.end());
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
  part_.clear();
  next.polygon.CopyTo(part_);
  for (const Plane& plane : planes_) {
    if (plane.Distance(next.center) > next.radius) {
      continue;  // the whole doorway lies beyond
    }
    ClipBeyondInto(part_, plane, clipped_);
    part_.swap(clipped_);
    if (part_.empty()) {
      return false;
    }
  }
  return true;
}

// The box that the planes leave of a cell's bounds; empty if they leave
// nothing.
Box3 BeamFlood::PartOf(const Box3& bounds) const {
  Box3 part = bounds;
  for (int pass = 0; pass < kPassesOfPart; ++pass) {
    for (const Plane& plane : planes_) {
      Tighten(plane, &part);
    }
    if (part.low.x > part.high.x || part.low.y > part.high.y ||
        part.low.z > part.high.z) {
      return {};
    }
  }
  return part;
}

bool BeamFlood::Run(const DoorwayGroup& firsts, ReachedParts* reached) {
  Begin(firsts);
  for (const Doorway* first : firsts) {
    Reach(*first, first->polygon.Copy(), kNone);
    nodes_.back().is_first = true;
  }
  uint64_t tests = 0;
  while (!waiting_.empty()) {
    ThrowIfStopRequested();
    const uint32_t number = TakeNearest();
    nodes_[number].passed_at = ++clock_;
    const Doorway& door = *nodes_[number].door;
    tests += regions_->Graph().Doorways(door.to).size();
    if (tests > kMostTests || nodes_.size() > kMostNodes) {
      reached->AddEverything();
      return false;
    }
    LookThrough(number);
    const CellId cell = regions_->CellOf(door.to);
    reached->Add(cell, PartOf(reached->BoundsOf(cell)));
    for (const Doorway* next : ahead_) {
      if (FindPart(*next)) {
        Reach(*next, next->is_sliver ? next->polygon.Copy() : part_, number);
      }
    }
  }
  return true;
}

}  // namespace enfilade
