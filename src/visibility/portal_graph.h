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

// Points x with normal . x >= offset lie beyond.
struct Plane {
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
  CellId to;
  std::vector<Point3> polygon;
  Plane plane;
  // Too thin for a normal: lines pass it wherever they like.
  bool is_sliver = false;
};

class PortalGraph {
 public:
  explicit PortalGraph(const Partition& partition);

  [[nodiscard]] size_t CellCount() const { return doorways_.size(); }

  // Out of a cell, by portal.
  [[nodiscard]] const std::vector<Doorway>& Doorways(CellId cell) const {
    return doorways_[cell.Index()];
  }

 private:
  std::vector<std::vector<Doorway>> doorways_;  // indexed by CellId
};

// The part of a convex polygon beyond the plane, kept a tolerance too large;
// empty if there is none.
std::vector<Point3> ClipBeyond(const std::vector<Point3>& polygon,
                               const Plane& plane);

// Whether some point lies before the plane, within the tolerance.
bool ReachesBefore(const std::vector<Point3>& polygon, const Plane& plane);

// Appends the rows that a line through the polygon satisfies, the polygon
// enlarged by the tolerance. Coordinates are taken relative to `origin` and
// scaled so that buildings and rows are of the order of one.
void AppendEdgeRows(const std::vector<Point3>& polygon,
                    Vec3 normal,
                    Point3 origin,
                    std::vector<PluckerRow>& rows);

}  // namespace enfilade
