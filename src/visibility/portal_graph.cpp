#include "visibility/portal_graph.h"

#include "base/planar_polygon.h"

#include <algorithm>
#include <numeric>

namespace enfilade {
namespace {

// Portals thinner than this count as slivers: rounding makes their normal
// useless.
constexpr double kSliverMetres = 1e-6;
// A point nearer to a plane than this lies in the plane. A line thus passes at
// most one of several doorways in one plane.
constexpr double kLeastAheadMetres = 1e-6;

// The unit of the coordinates in edge rows, in which both the directions and
// the moments of a row are of order one.
constexpr double kRowUnitMetres = 8;

Doorway MakeDoorway(PortalId id, CellId to, const Outline& polygon) {
  Doorway door;
  door.portal = id;
  door.to = to;
  door.polygon = polygon;
  const std::vector<Point3> vertices = polygon.Copy();
  const Vec3 area = AreaVector(vertices);
  double longest = 0;
  Box3 bounds;
  for (const Point3 p : vertices) {
    longest = std::max(longest, Length(p - vertices.front()));
    bounds.Include(p);
  }
  door.center = bounds.Center();
  door.radius = 0.5 * Length(bounds.Extent());
  door.is_sliver = Length(area) <= kSliverMetres * longest;
  if (!door.is_sliver) {
    door.plane.normal = Normalize(area);
    Vec3 sum;
    for (const Point3 p : vertices) {
      sum = sum + (p - Point3{});
    }
    door.plane.offset =
        Dot(door.plane.normal, sum) / static_cast<double>(vertices.size());
  }
  return door;
}

// Portals without vertices or within one cell lead nowhere.
bool IsDoor(const Portal& portal) {
  return portal.front != portal.back && !portal.vertices.empty();
}

}  // namespace

void Outline::CopyTo(std::vector<Point3>& vertices) const {
  for (size_t i = 0; i < Size(); ++i) {
    vertices.push_back((*this)[i]);
  }
}

std::vector<Point3> Outline::Copy() const {
  std::vector<Point3> vertices;
  vertices.reserve(Size());
  CopyTo(vertices);
  return vertices;
}

PortalGraph::PortalGraph(size_t cells,
                         const PortalSource& portals,
                         MemoryBudget& budget,
                         double share) {
  first_.resize(cells + 1);
  Count(portals);
  const uint64_t bytes = first_.size() * sizeof(uint32_t) +
                         uint64_t{first_.back()} * sizeof(Doorway) +
                         point_count_ * sizeof(Point3);
  charge_ = MemoryCharge(
      budget, bytes, "the doorways of the building", ComingBytes(bytes, share));
  doorways_.resize(first_.back());
  points_.reserve(point_count_);
  Fill(portals);
}

// Finds where the doorways of each cell begin in doorways_.
void PortalGraph::Count(const PortalSource& portals) {
  portals([this](const Portal& portal) {
    if (IsDoor(portal)) {
      ++first_[portal.front.Index() + 1];
      ++first_[portal.back.Index() + 1];
      point_count_ += portal.vertices.size();
    }
  });
  std::partial_sum(first_.begin(), first_.end(), first_.begin());
}

// Fills doorways_ and points_. A line from front to back runs against the
// normal of the vertices' order.
void PortalGraph::Fill(const PortalSource& portals) {
  std::vector<uint32_t> next = first_;
  uint32_t portal_number = 0;
  uint32_t doorway_number = 0;
  portals([&](const Portal& portal) {
    const PortalId id(portal_number++);
    if (!IsDoor(portal)) {
      return;
    }
    const size_t begin = points_.size();
    points_.insert(
        points_.end(), portal.vertices.begin(), portal.vertices.end());
    const auto vertices = std::span<const Point3>(points_).subspan(begin);
    const auto add = [&](CellId from, Doorway door) {
      door.index = doorway_number++;
      doorways_[next[from.Index()]++] = door;
    };
    add(portal.front, MakeDoorway(id, portal.back, Outline::Reverse(vertices)));
    add(portal.back, MakeDoorway(id, portal.front, Outline::Forward(vertices)));
  });
}

std::vector<Point3> ClipBeyond(const std::vector<Point3>& polygon,
                               const Plane& plane) {
  std::vector<Point3> kept;
  ClipBeyondInto(polygon, plane, kept);
  return kept;
}

void ClipBeyondInto(const std::vector<Point3>& polygon,
                    const Plane& plane,
                    std::vector<Point3>& kept) {
  kept.clear();
  const auto beyond = [&](Point3 p) {
    return plane.Distance(p) + kStabToleranceMetres;
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

bool ReachesBefore(const std::vector<Point3>& polygon, const Plane& plane) {
  return std::any_of(polygon.begin(), polygon.end(), [&](Point3 p) {
    return plane.Distance(p) < -kLeastAheadMetres;
  });
}

bool ReachesBeyond(const Outline& polygon, const Plane& plane) {
  for (size_t i = 0; i < polygon.Size(); ++i) {
    if (plane.Distance(polygon[i]) > kLeastAheadMetres) {
      return true;
    }
  }
  return false;
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
    // Only the line of the edge counts, so the row takes a unit length along
    // it.
    const Point3 from = Point3{} + p / kRowUnitMetres;
    rows.push_back(EdgeRow(from, from + edge / length));
  }
}

}  // namespace enfilade
