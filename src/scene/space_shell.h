// The shell of a Space: the polygons that have the Space on one side only.
//
// The orientation of the polygons is not known beforehand. The parity of
// crossings along a ray tells whether a point is inside without any
// orientation, and a majority vote of rays in different directions tolerates
// small gaps.

#pragma once

#include "base/vec.h"
#include "scene/figure_cut.h"
#include "scene/polygon_cut.h"

#include <cstdint>
#include <span>
#include <vector>

namespace enfilade {

class SpaceShell {
 public:
  // Requires a polygon that is planar, simple and not degenerate.
  void Add(std::span<const Point3> polygon);

  // Whether most of `kRays` rays from p cross the shell an odd number of times.
  [[nodiscard]] bool Contains(Point3 p) const;

  // Whether the polygons' edges cancel: along every edge, an even number of
  // edges coincide within the tolerance (in metres). T-junctions are no gaps.
  [[nodiscard]] bool IsClosed(double tolerance) const {
    return !edges_.empty() && OpenLength(tolerance) == 0;
  }

  // The length in metres, summed over the edges of all polygons, along which an
  // odd number of edges coincide.
  [[nodiscard]] double OpenLength(double tolerance) const;

  // Those of all polygons in the order in which these were added.
  [[nodiscard]] std::span<const Edge3> Edges() const { return edges_; }

  [[nodiscard]] const Box3& Bounds() const { return bounds_; }

 private:
  struct Side {
    PlaneFrame frame;
    Polygon2 outline;
  };

  [[nodiscard]] size_t Crossings(Point3 origin, Vec3 direction) const;
  [[nodiscard]] double OpenLengthOf(const Edge3& edge, double tolerance) const;

  std::vector<Side> sides_;
  std::vector<Edge3> edges_;
  Box3 bounds_;
};

}  // namespace enfilade
