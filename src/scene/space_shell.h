// The shell of a Space: the polygons that have it on one side only.
//
// Their orientation is not known beforehand. Inside is found by the parity of
// crossings along rays, so a shell needs no orientation, and a majority of
// rays in different directions bears with small gaps.

#pragma once

#include "base/vec.h"
#include "scene/polygon_cut.h"

#include <cstdint>
#include <span>
#include <vector>

namespace enfilade {

class SpaceShell {
 public:
  // `polygon`: planar, simple, not degenerate.
  void Add(std::span<const Point3> polygon);

  // Most of `kRays` rays from p cross the shell an odd number of times.
  [[nodiscard]] bool Contains(Point3 p) const;

  // The polygons' edges cancel: along every edge, an even number of them lie
  // on each other within the tolerance (in metres). T-junctions are no gaps.
  [[nodiscard]] bool IsClosed(double tolerance) const {
    return !edges_.empty() && OpenLength(tolerance) == 0;
  }

  // Metres of edges, each polygon's counted, along which the number is odd.
  [[nodiscard]] double OpenLength(double tolerance) const;

  [[nodiscard]] const Box3& Bounds() const { return bounds_; }

 private:
  struct Side {
    PlaneFrame frame;
    Polygon2 outline;
  };

  struct Edge {
    Point3 from, to;
  };

  [[nodiscard]] size_t Crossings(Point3 origin, Vec3 direction) const;
  [[nodiscard]] double OpenLengthOf(const Edge& edge, double tolerance) const;

  std::vector<Side> sides_;
  std::vector<Edge> edges_;
  Box3 bounds_;
};

}  // namespace enfilade
