// Finds the lines that a patch is to be cut along, from what touches the patch.

#pragma once

#include "partition/overlap.h"
#include "partition/polygon.h"
#include "partition/segment_cut.h"

#include <cstddef>
#include <functional>
#include <optional>
#include <vector>

namespace enfilade {

// A polygon that reaches no further than this in front of a surface lies in
// that surface, m.
inline constexpr double kInPlaneM = kMostLayers * kApartM + kCoincidentM;

// Shorter contacts are left to refinement, m: cutting along the legs of chairs
// would leave a floor in splinters. A contact that is as near to a lamp as it
// is long is cut even if it is shorter, because light is brightest there.
inline constexpr double kLeastContactM = 0.3;

// A patch is cut into at most this many parts, plus the same number again for
// each foot beside a lamp, because a ceiling may have any number of downlights.
inline constexpr size_t kMostContactParts = 64;

// The segment where a polygon that reaches in front of the plane meets the
// plane. Of the polygon's points in the plane, the segment joins the two that
// are farthest apart. nullopt if the polygon only lies in the plane or does not
// meet it.
std::optional<Segment> FootOf(const Polygon& polygon, const Plane& plane);

// Where surfaces touch a patch.
struct Touching {
  std::vector<Segment> feet;  // of surfaces that stand on it
  std::vector<Segment> rims;  // of surfaces that lie on it
};

// Connected segments of surfaces that stand on a patch.
struct Feet {
  double length = 0;  // diagonal of the box around all segments
  std::vector<Segment> segments;
};

// The lines that a patch is to be cut along.
struct ContactLines {
  // The lines of surfaces that lie on the patch, and of surfaces that stand
  // beside a lamp; `rims.spared` lists the feet beside lamps.
  CutLines rims;
  std::vector<Feet> feet;  // all other feet, the longest first

  [[nodiscard]] bool IsEmpty() const {
    return rims.segments.empty() && feet.empty();
  }

  [[nodiscard]] size_t MostParts() const {
    return kMostContactParts * (1 + rims.spared.size());
  }
};

// Selects chains of connected segments: those that are at least kLeastContactM
// long, and those that have a lamp beside them. `meets_lamp` says whether a box
// meets a lamp; a lamp is beside a chain if its distance is at most the chain's
// length and at most kLeastContactM. A short chain beside a lamp gets a frame
// around it if the polygon is far larger.
ContactLines LinesThatMatter(
    const Touching& touching,
    const Polygon& polygon,
    const Plane& plane,
    const std::function<bool(const Box3&)>& meets_lamp);

// Cuts the polygon and returns its parts. Cuts along all feet or, if that would
// make too many parts, along the longest ones only. Cutting along just some of
// many feet of one length would leave a floor in strips that do not help the
// other feet, so the feet that do not fit are left to refinement together with
// all feet of about the same length.
std::vector<Polygon> CutAlongThoseThatFit(const ContactLines& lines,
                                          const Polygon& polygon,
                                          const Plane& plane);

}  // namespace enfilade
