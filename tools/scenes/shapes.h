// Building blocks of the generated scenes: axis-parallel rectangles, panels
// with rectangular holes, the lining of openings, boxes and chairs. Every face
// is planar, convex and counter-clockwise seen from its front.

#pragma once

#include "base/vec.h"

#include <array>
#include <cmath>
#include <span>
#include <vector>

#include "tools/scenes/obj_writer.h"

namespace enfilade {

// A rectangle in the two axes (u, v) of a plane, metres.
struct Rect {
  double u0 = 0, u1 = 0, v0 = 0, v1 = 0;

  [[nodiscard]] double Width() const { return u1 - u0; }

  [[nodiscard]] double Height() const { return v1 - v0; }

  [[nodiscard]] bool Overlaps(const Rect& r) const {
    return u0 < r.u1 && r.u0 < u1 && v0 < r.v1 && r.v0 < v1;
  }

  [[nodiscard]] bool Contains(const Rect& r) const {
    return u0 <= r.u0 && r.u1 <= u1 && v0 <= r.v0 && r.v1 <= v1;
  }
};

enum class Axis { kX, kY, kZ };

// An axis-parallel plane and the way its front faces. (u, v) are the world
// coordinates (y, z) for kX, (x, z) for kY and (x, y) for kZ.
struct AxisPlane {
  Axis axis = Axis::kZ;
  double at = 0;
  bool faces_positive = true;
};

void AddRect(ObjWriter& out, const AxisPlane& plane, const Rect& rect);

// Adds `rect` without the holes, as few rectangles. The holes must lie inside
// `rect` and their u ranges must be disjoint; their order does not matter.
void AddPanel(ObjWriter& out,
              const AxisPlane& plane,
              const Rect& rect,
              std::vector<Rect> holes);

// Adds the four faces that line an opening between the planes at a0 < a1 across
// `axis`; their fronts look into the opening. `opening` is its cross-section in
// the (u, v) of `axis`.
void AddLining(
    ObjWriter& out, Axis axis, double a0, double a1, const Rect& opening);

// Where a piece of furniture stands. A point of the piece's own frame is scaled
// by `scale`, turned about Z by `angle` (radians), then moved by `origin`.
class Placement {
 public:
  Placement(Point3 origin, double angle, double scale = 1)
      : origin_(origin),
        cos_(scale * std::cos(angle)),
        sin_(scale * std::sin(angle)),
        scale_(scale) {}

  [[nodiscard]] Point3 At(Point3 p) const {
    return {origin_.x + cos_ * p.x - sin_ * p.y,
            origin_.y + sin_ * p.x + cos_ * p.y,
            origin_.z + scale_ * p.z};
  }

 private:
  Point3 origin_;
  double cos_;
  double sin_;
  double scale_;
};

// The faces of a box, to be combined with |.
enum BoxFaces : unsigned {
  kWestFace = 1,
  kEastFace = 2,
  kSouthFace = 4,
  kNorthFace = 8,
  kBottomFace = 16,
  kTopFace = 32,
  kSideFaces = 15,
  kAllFaces = 63,
};

// Outward faces of the box, in the frame of `placement`.
void AddBox(ObjWriter& out,
            const Placement& placement,
            const Box3& box,
            unsigned faces = kAllFaces);

// Measures of the chair, metres.
inline constexpr double kChairSeatSide = 0.45;
inline constexpr double kChairHeight = 0.90;
// The radius of a circle about the origin of the chair's frame that contains
// the plan of the chair.
inline constexpr double kChairRadius = 0.319;

enum class ChairBuild {
  // 27 quadrilaterals: four legs of four sides, a seat of six, a back of five;
  // the legs stand on the floor and end at the underside of the seat.
  kStanding,
  // 33 quadrilaterals: one closed surface without hidden parts, whose feet are
  // closed and hang kChairFootGap above the floor.
  kClosed,
};
inline constexpr double kChairFootGap = 0.02;

// Adds a chair of the current material whose seat is centred at the origin of
// the placement. The chair looks along +y; its back is at -y.
void AddChair(ObjWriter& out, const Placement& placement, ChairBuild build);

}  // namespace enfilade
