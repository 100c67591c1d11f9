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

// `rect` less the holes, in few rectangles. Requires holes inside `rect`,
// disjoint in u; any order.
void AddPanel(ObjWriter& out,
              const AxisPlane& plane,
              const Rect& rect,
              std::vector<Rect> holes);

// The four faces that line an opening of cross-section `opening` (in the (u, v)
// of `axis`) between the planes at a0 < a1, fronts facing into the opening.
void AddLining(
    ObjWriter& out, Axis axis, double a0, double a1, const Rect& opening);

// Where a piece of furniture stands: its own frame, made `scale` times as
// large, turned about Z by `angle` (radians), then moved to `origin`.
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
// A circle about the origin of the chair's frame that holds its plan.
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

// A chair whose seat is centred at the placement and looks along +y, the back
// at -y. Uses the current material.
void AddChair(ObjWriter& out, const Placement& placement, ChairBuild build);

}  // namespace enfilade
