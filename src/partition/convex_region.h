// A convex region of space, bounded by polygons. The leaves of the partition
// are such regions before they are joined into cells.

#pragma once

#include "base/vec.h"
#include "partition/polygon.h"

#include <cstdint>
#include <vector>

namespace enfilade {

class ConvexRegion {
 public:
  // An empty region that can only be assigned to.
  ConvexRegion() = default;

  explicit ConvexRegion(const Box3& box);

  // The polygon in which the plane cuts the region, facing the plane's front;
  // empty if the plane misses the region or only grazes it.
  [[nodiscard]] Polygon CrossSection(const Plane& plane) const;

  // The parts of the region in front of and behind the plane. The plane's
  // cross-section must not be empty, and its Thickness on both sides must be
  // positive.
  struct Halves;
  [[nodiscard]] Halves Cut(const Plane& plane) const;

  // The greatest distance of the region from the plane on either side.
  struct Thickness {
    double front_m = 0;
    double back_m = 0;
  };

  [[nodiscard]] Thickness ThicknessAt(const Plane& plane) const;

  // The least width: the smallest, over all facets, of the distance from the
  // facet's plane to the farthest corner.
  [[nodiscard]] double LeastWidth() const;

  [[nodiscard]] double Volume() const;
  [[nodiscard]] Box3 Bounds() const;
  [[nodiscard]] Point3 Center() const;
  [[nodiscard]] std::vector<Point3> Corners() const;  // each once

  // The memory that the facets take.
  [[nodiscard]] uint64_t FacetBytes() const;

 private:
  struct Facet {
    Plane plane;  // points out of the region
    Polygon polygon;
  };

  [[nodiscard]] ConvexRegion ClippedTo(const Plane& outward,
                                       const Polygon& cap) const;

  std::vector<Facet> facets_;
};

struct ConvexRegion::Halves {
  ConvexRegion front;
  ConvexRegion back;
};

}  // namespace enfilade
