// The portals as a graph of doorways that a line passes in one direction, and
// the plane geometry that stabbing needs. Internal to src/visibility.

#pragma once

#include "base/ids.h"
#include "base/vec.h"
#include "partition/partition.h"
#include "visibility/cone.h"

#include <cstdint>
#include <vector>

namespace enfilade {

// All tests lean to the visible side by this much.
constexpr double kStabToleranceMetres = 1e-4;

// Shorter edges of doorways say nothing of their direction.
inline constexpr double kLeastEdgeMetres = 1e-7;

// Points x with normal . x >= offset lie beyond.
struct DoorPlane {
  Vec3 normal;  // of length 1
  double offset = 0;

  // Metres beyond the plane; negative before it.
  [[nodiscard]] double Beyond(Point3 p) const {
    return Dot(normal, p - Point3{}) - offset;
  }
};

// One direction through a portal: its vertices run counter-clockwise around
// the direction of passing, which is the plane's normal.
struct Doorway {
  PortalId portal;
  uint32_t index = 0;  // among all doorways of the graph
  CellId to;
  std::vector<Point3> polygon;
  Point3 center;  // of a ball around the polygon
  double radius = 0;
  DoorPlane plane;
  // Too thin for a normal: lines pass it wherever they like.
  bool is_sliver = false;
};

class PortalGraph {
 public:
  // Of so many cells, or of regions and their openings.
  PortalGraph(size_t cells, const std::vector<Portal>& portals);

  [[nodiscard]] size_t CellCount() const { return doorways_.size(); }

  [[nodiscard]] size_t DoorwayCount() const { return doorway_count_; }

  // What it takes in memory; and at most, while it is made of these.
  [[nodiscard]] uint64_t SizeBytes() const;
  static uint64_t MostBytes(size_t cells, const std::vector<Portal>& portals);

  // Out of a cell, by portal.
  [[nodiscard]] const std::vector<Doorway>& Doorways(CellId cell) const {
    return doorways_[cell.Index()];
  }

 private:
  std::vector<std::vector<Doorway>> doorways_;  // indexed by CellId
  size_t doorway_count_ = 0;
};

// The part of a convex polygon beyond the plane, kept a tolerance too large;
// empty if there is none.
std::vector<Point3> ClipBeyond(const std::vector<Point3>& polygon,
                               const DoorPlane& plane);

// The same into a polygon that exists, whose memory is used again.
void ClipBeyondInto(const std::vector<Point3>& polygon,
                    const DoorPlane& plane,
                    std::vector<Point3>& kept);

// Whether some point lies before the plane, and not in it.
bool ReachesBefore(const std::vector<Point3>& polygon, const DoorPlane& plane);

// Likewise beyond it.
bool ReachesBeyond(const std::vector<Point3>& polygon, const DoorPlane& plane);

// Appends the rows that a line through the polygon satisfies, the polygon
// enlarged by the tolerance. Coordinates are taken relative to `origin` and
// scaled so that buildings and rows are of the order of one.
void AppendEdgeRows(const std::vector<Point3>& polygon,
                    Vec3 normal,
                    Point3 origin,
                    std::vector<PluckerRow>& rows);

}  // namespace enfilade
