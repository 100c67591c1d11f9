// Of what touches a patch, the lines that the patch is to be cut along.

#pragma once

#include "partition/overlap.h"
#include "partition/polygon.h"
#include "partition/segment_cut.h"

#include <cstddef>
#include <functional>
#include <optional>
#include <vector>

namespace enfilade {

// What reaches no further before a surface lies in it.
inline constexpr double kInPlaneM = kMostLayers * kApartM + kCoincidentM;

// The legs of chairs are left to refinement: a floor would be in splinters. But
// not what is as near to a lamp as it is long: there light is brightest.
inline constexpr double kLeastContactM = 0.3;

// Patches are not cut into more parts than this, and than this again for each
// foot beside a lamp: a ceiling has as many downlights as it has.
inline constexpr size_t kMostContactParts = 64;

// Where a polygon that reaches before the plane meets it: the segment between
// the two points farthest apart of those in the plane.
std::optional<Segment> FootOf(const Polygon& polygon, const Plane& plane);

// Where surfaces touch a patch.
struct Touching {
  std::vector<Segment> feet;  // of what stands on it
  std::vector<Segment> rims;  // of what lies on it
};

// Segments that hang together, of what stands on a patch.
struct Feet {
  double length = 0;  // from end to end of all of them
  std::vector<Segment> segments;
};

// Those of them that a patch is to be cut along.
struct ContactLines {
  // Of what lies on it, and of what stands beside a lamp: these are spared.
  CutLines rims;
  std::vector<Feet> feet;  // of all else, the longest first

  [[nodiscard]] bool IsEmpty() const {
    return rims.segments.empty() && feet.empty();
  }

  [[nodiscard]] size_t MostParts() const {
    return kMostContactParts * (1 + rims.spared.size());
  }
};

// Those that reach far together with all that they hang together with, or that
// have a lamp beside them (`meets_lamp`: whether a box does): as near as they
// are long, or as what counts as long. Small ones are framed where the polygon
// is far larger.
ContactLines LinesThatMatter(
    const Touching& touching,
    const Polygon& polygon,
    const Plane& plane,
    const std::function<bool(const Box3&)>& meets_lamp);

// The parts of the polygon. Along all feet or, where that takes more parts than
// there may be, along the longest. A floor would be in strips along some of its
// many feet, which are of no use to the others: what does not fit is left to
// refinement, with all that is as short.
std::vector<Polygon> CutAlongThoseThatFit(const ContactLines& lines,
                                          const Polygon& polygon,
                                          const Plane& plane);

}  // namespace enfilade
