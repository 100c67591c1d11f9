#include "visibility/portal_graph.h"

#include "base/memory.h"

#include <algorithm>

namespace enfilade {
namespace {

// Thinner portals count as slivers: their normal is lost in rounding.
constexpr double kSliverMetres = 1e-6;
// Doorways of one plane: a line passes at most one of them.
constexpr double kLeastAheadMetres = 1e-6;

// Edge rows mix directions and moments: in this unit both are of order one.
constexpr double kRowUnitMetres = 8;

Doorway MakeDoorway(PortalId id, CellId to, std::vector<Point3> polygon) {
  Doorway door;
  door.portal = id;
  door.to = to;
  const Vec3 area = AreaVector(polygon);
  double longest = 0;
  Box3 bounds;
  for (const Point3 p : polygon) {
    longest = std::max(longest, Length(p - polygon.front()));
    bounds.Include(p);
  }
  door.center = bounds.Center();
  door.radius = 0.5 * Length(bounds.Extent());
  door.is_sliver = Length(area) <= kSliverMetres * longest;
  if (!door.is_sliver) {
    door.plane.normal = Normalize(area);
    Vec3 sum;
    for (const Point3 p : polygon) {
      sum = sum + (p - Point3{});
    }
    door.plane.offset =
        Dot(door.plane.normal, sum) / static_cast<double>(polygon.size());
  }
  door.polygon = std::move(polygon);
  return door;
}

}  // namespace

// A line from front to back runs against the normal of the vertices' order.
PortalGraph::PortalGraph(size_t cells, const std::vector<Portal>& portals)
    : doorways_(cells) {
  // What grows would take twice as much.
  std::vector<size_t> counts(cells);
  for (const Portal& portal : portals) {
    ++counts[portal.front.Index()];
    ++counts[portal.back.Index()];
  }
  for (size_t i = 0; i < cells; ++i) {
    doorways_[i].reserve(counts[i]);
  }
  for (size_t i = 0; i < portals.size(); ++i) {
    const Portal& portal = portals[i];
    if (portal.front == portal.back || portal.vertices.empty()) {
      continue;
    }
    const std::vector<Point3>& forward = portal.vertices;
    const std::vector<Point3> reverse(forward.rbegin(), forward.rend());
    const auto add = [&](CellId from, Doorway door) {
      door.index = static_cast<uint32_t>(doorway_count_++);
      doorways_[from.Index()].push_back(std::move(door));
    };
    add(portal.front, MakeDoorway(PortalId(i), portal.back, reverse));
    add(portal.back, MakeDoorway(PortalId(i), portal.front, forward));
  }
}

uint64_t PortalGraph::SizeBytes() const {
  uint64_t bytes = doorways_.capacity() * sizeof(std::vector<Doorway>);
  for (const std::vector<Doorway>& out : doorways_) {
    bytes += out.capacity() * sizeof(Doorway) + kAllocationHeaderBytes;
    for (const Doorway& door : out) {
      bytes +=
          door.polygon.capacity() * sizeof(Point3) + kAllocationHeaderBytes;
    }
  }
  return bytes;
}

uint64_t PortalGraph::MostBytes(size_t cells,
                                const std::vector<Portal>& portals) {
  uint64_t bytes = cells * (sizeof(std::vector<Doorway>) + sizeof(size_t) +
                            kAllocationHeaderBytes);
  for (const Portal& portal : portals) {
    bytes += 2 * (sizeof(Doorway) + kAllocationHeaderBytes +
                  portal.vertices.size() * sizeof(Point3));
  }
  return bytes;
}

std::vector<Point3> ClipBeyond(const std::vector<Point3>& polygon,
                               const DoorPlane& plane) {
  std::vector<Point3> kept;
  ClipBeyondInto(polygon, plane, kept);
  return kept;
}

void ClipBeyondInto(const std::vector<Point3>& polygon,
                    const DoorPlane& plane,
                    std::vector<Point3>& kept) {
  kept.clear();
  const auto beyond = [&](Point3 p) {
    return plane.Beyond(p) + kStabToleranceMetres;
  };
  if (polygon.empty()) {
    return;
  }
  double dp = beyond(polygon.front());
  for (size_t i = 0; i < polygon.size(); ++i) {
    const Point3 p = polygon[i];
    const Point3 q = polygon[i + 1 < polygon.size() ? i + 1 : 0];
    const double dq = beyond(q);
    if (dp >= 0) {
      kept.push_back(p);
    }
    if ((dp < 0) != (dq < 0)) {
      kept.push_back(Lerp(p, q, dp / (dp - dq)));
    }
    dp = dq;
  }
}

bool ReachesBefore(const std::vector<Point3>& polygon, const DoorPlane& plane) {
  return std::any_of(polygon.begin(), polygon.end(), [&](Point3 p) {
    return plane.Beyond(p) < -kLeastAheadMetres;
  });
}

bool ReachesBeyond(const std::vector<Point3>& polygon, const DoorPlane& plane) {
  return std::any_of(polygon.begin(), polygon.end(), [&](Point3 p) {
    return plane.Beyond(p) > kLeastAheadMetres;
  });
}

void AppendEdgeRows(const std::vector<Point3>& polygon,
                    Vec3 normal,
                    Point3 origin,
                    std::vector<PluckerRow>& rows) {
  const size_t n = polygon.size();
  for (size_t i = 0; i < n; ++i) {
    const Vec3 edge = polygon[(i + 1) % n] - polygon[i];
    const double length = Length(edge);
    if (length < kLeastEdgeMetres) {
      continue;
    }
    const Vec3 outward = Cross(edge, normal) / length;
    const Vec3 p = polygon[i] - origin + outward * kStabToleranceMetres;
    // The edge's line is all that counts: a unit along it.
    const Point3 from = Point3{} + p / kRowUnitMetres;
    rows.push_back(EdgeRow(from, from + edge / length));
  }
}

}  // namespace enfilade
