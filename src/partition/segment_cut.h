// Cuts convex polygons along segments in their plane.

#pragma once

#include "base/vec.h"
#include "partition/polygon.h"

#include <cstddef>
#include <vector>

namespace enfilade {

// Parts narrower than this are not made, m.
inline constexpr double kNarrowPartM = 1e-3;
inline constexpr double kShortRunM = 0.02;

struct Segment {
  Point3 a, b;
  // Parts that it runs no further through are not cut by it, m.
  double least_run = kShortRunM;
};

// Cuts a polygon of this normal until no segment runs through the inside of a
// part: along the line of the one that runs furthest, then each part by itself
// (a binary space partition of the plane). Stops at `most_parts`. The parts are
// convex, face as the polygon does, and cover it without overlap.
std::vector<Polygon> CutAlongSegments(const Polygon& polygon,
                                      Vec3 normal,
                                      const std::vector<Segment>& segments,
                                      size_t most_parts);

}  // namespace enfilade
