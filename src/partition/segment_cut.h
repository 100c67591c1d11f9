// Cuts convex polygons along segments in their plane.

#pragma once

#include "base/vec.h"
#include "partition/polygon.h"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace enfilade {

// Parts narrower than this are not made, m.
inline constexpr double kNarrowPartM = 1e-3;
inline constexpr double kShortRunM = 0.02;

struct Segment {
  Point3 a, b;
  // Parts that it runs no further through are not cut by it, m.
  double least_run = kShortRunM;
  uint32_t foot = 0;  // of those to be spared, whose it is; 0: nobody's
};

// What lines of others should not go through if they can go elsewhere: the foot
// of a lamp, which they would leave in splinters that are not cut any more.
struct Spared {
  Point3 middle;
  double radius = 0;
  uint32_t foot = 0;  // that of its own lines
};

// Where a polygon is to be cut.
struct CutLines {
  std::vector<Segment> segments;
  std::vector<Spared> spared;
};

// Cuts a polygon of this normal until no segment runs through the inside of a
// part: along the line of the one that goes through the fewest of what is to be
// spared, and of those runs furthest, then each part by itself (a binary space
// partition of the plane). Stops at `most_parts`. The parts are convex, face as
// the polygon does, and cover it without overlap.
std::vector<Polygon> CutAlongSegments(const Polygon& polygon,
                                      Vec3 normal,
                                      const CutLines& lines,
                                      size_t most_parts);

}  // namespace enfilade
