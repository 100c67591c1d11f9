// The portals as a graph of doorways, each of which a line passes in one
// direction, and the plane geometry that stabbing needs. Lines pass a plane
// along its normal: beyond it is in front of it. Internal to src/visibility.

#pragma once

#include "base/ids.h"
#include "base/memory.h"
#include "base/plane.h"
#include "base/vec.h"
#include "partition/partition_store.h"
#include "visibility/cone.h"

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace enfilade {

// All tests err on the side of visibility by this much.
constexpr double kStabToleranceMetres = 1e-4;

// Edges of doorways shorter than this have no reliable direction and are
// ignored.
inline constexpr double kLeastEdgeMetres = 1e-7;

// The vertices of a portal, in their order or in reverse. Borrows the vertices.
class Outline {
 public:
  Outline() = default;

  static Outline Forward(std::span<const Point3> vertices) {
    return {vertices.data(), vertices.size(), 1};
  }

  // Requires at least one vertex.
  static Outline Reverse(std::span<const Point3> vertices) {
    return {&vertices.back(), vertices.size(), -1};
  }

  [[nodiscard]] size_t Size() const { return count_; }

  [[nodiscard]] const Point3& operator[](size_t i) const {
    return first_[step_ * static_cast<std::ptrdiff_t>(i)];
  }

  // Appends the vertices.
  void CopyTo(std::vector<Point3>& vertices) const;

  [[nodiscard]] std::vector<Point3> Copy() const;

 private:
  Outline(const Point3* first, size_t count, int32_t step)
      : first_(first), count_(static_cast<uint32_t>(count)), step_(step) {}

  const Point3* first_ = nullptr;
  uint32_t count_ = 0;
  int32_t step_ = 1;
};

// One direction through a portal. Its vertices run counter-clockwise around the
// direction of passing, which is the plane's normal.
struct Doorway {
  PortalId portal;
  uint32_t index = 0;  // among all doorways of the graph
  CellId to;
  // Too thin to have a normal: its edges and plane restrict no line.
  bool is_sliver = false;
  Outline polygon;
  Point3 center;  // of a ball around the polygon
  double radius = 0;
  Plane plane;
};

class PortalGraph {
 public:
  // Makes the graph of so many cells and their portals, or of regions and their
  // openings. Goes through the portals twice. Charges the memory of the graph,
  // as a `share` of all that is to be charged. Throws DoesNotFitError.
  PortalGraph(size_t cells,
              const PortalSource& portals,
              MemoryBudget& budget,
              double share = 1);

  [[nodiscard]] size_t CellCount() const { return first_.size() - 1; }

  [[nodiscard]] size_t DoorwayCount() const { return doorways_.size(); }

  // The doorways out of a cell, in the order of portals.
  [[nodiscard]] std::span<const Doorway> Doorways(CellId cell) const {
    const size_t first = first_[cell.Index()];
    return std::span(doorways_).subspan(first,
                                        first_[cell.Index() + 1] - first);
  }

 private:
  void Count(const PortalSource& portals);
  void Fill(const PortalSource& portals);

  MemoryCharge charge_;
  std::vector<uint32_t> first_;    // by cell, and one after the last
  std::vector<Doorway> doorways_;  // by the cell they lead out of
  std::vector<Point3> points_;     // of all portals
  uint64_t point_count_ = 0;
};

// The part of a convex polygon beyond the plane, too large by the tolerance;
// empty if there is none.
std::vector<Point3> ClipBeyond(const std::vector<Point3>& polygon,
                               const Plane& plane);

// Like ClipBeyond, but writes into `kept`, whose memory is reused.
void ClipBeyondInto(const std::vector<Point3>& polygon,
                    const Plane& plane,
                    std::vector<Point3>& kept);

// Whether some point of the polygon lies before the plane, and not in it.
bool ReachesBefore(const std::vector<Point3>& polygon, const Plane& plane);

// Whether some point of the polygon lies beyond the plane, and not in it.
bool ReachesBeyond(const Outline& polygon, const Plane& plane);

// Appends the rows of the polygon's edges, which every line through the polygon
// satisfies. The polygon is enlarged by the tolerance first. Coordinates are
// taken relative to `origin` and scaled so that buildings and rows are of the
// order of one.
void AppendEdgeRows(const std::vector<Point3>& polygon,
                    Vec3 normal,
                    Point3 origin,
                    std::vector<PluckerRow>& rows);

}  // namespace enfilade
