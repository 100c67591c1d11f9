// Cuts convex polygons along segments in their plane.

#pragma once

#include "base/vec.h"
#include "partition/polygon.h"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace enfilade {

// No part narrower than this is made, m.
inline constexpr double kNarrowPartM = 1e-3;
inline constexpr double kShortRunM = 0.02;

struct Segment {
  Point3 a, b;
  // The segment cuts a part only if it runs at least this far through it, m.
  double least_run = kShortRunM;
  // The number of the spared foot that the segment belongs to; 0 if none.
  uint32_t foot = 0;
};

// The foot of something beside a lamp. Lines of other feet should not run
// through it if they can run elsewhere: they would leave it in splinters that
// are not cut any further.
struct Spared {
  Point3 middle;
  double radius = 0;
  uint32_t foot = 0;  // number of this foot, on its own lines
};

// Where a polygon is to be cut.
struct CutLines {
  std::vector<Segment> segments;
  std::vector<Spared> spared;
};

// Cuts a polygon with this normal until no segment runs through the inside of a
// part, or until there are `most_parts` parts. Each part is cut by itself (a
// binary space partition of the plane), along the line of the segment that runs
// through the fewest spared feet and, among those, has the longest run. A line
// that would make a narrow strip which is longer than its run comes last; if no
// other is left, the part is first cut across at an end of the run. The parts
// are convex, face the same way as the polygon, and cover it without overlap.
std::vector<Polygon> CutAlongSegments(const Polygon& polygon,
                                      Vec3 normal,
                                      const CutLines& lines,
                                      size_t most_parts);

}  // namespace enfilade
