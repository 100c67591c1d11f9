// Polygons by the numbers of their vertices in a list of points.

#pragma once

#include "base/vec.h"

#include <cstdint>
#include <span>
#include <vector>

namespace enfilade {

using VertexLoop = std::vector<uint32_t>;

inline std::vector<Point3> PointsOf(std::span<const Point3> vertices,
                                    const VertexLoop& loop) {
  std::vector<Point3> points;
  points.reserve(loop.size());
  for (const uint32_t v : loop) {
    points.push_back(vertices[v]);
  }
  return points;
}

}  // namespace enfilade
