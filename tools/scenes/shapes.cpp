#include "tools/scenes/shapes.h"

#include "base/check.h"

#include <algorithm>

namespace enfilade {

namespace {

constexpr double kSeatBottom = 0.41;
constexpr double kSeatTop = 0.45;
constexpr double kLegSide = 0.04;
constexpr double kBackThickness = 0.03;
constexpr double kHalfSeat = kChairSeatSide / 2;

Point3 PointOn(const AxisPlane& plane, double u, double v) {
  switch (plane.axis) {
    case Axis::kX:
      return {plane.at, u, v};
    case Axis::kY:
      return {u, plane.at, v};
    case Axis::kZ:
      break;
  }
  return {u, v, plane.at};
}

// Adds the four legs. The outer sides of the legs lie `inset` inside those of
// the seat.
void AddLegs(ObjWriter& out,
             const Placement& placement,
             double inset,
             double foot,
             unsigned faces) {
  const double low = -kHalfSeat + inset;
  const double high = kHalfSeat - inset - kLegSide;
  for (const double x : {low, high}) {
    for (const double y : {low, high}) {
      AddBox(out,
             placement,
             {{x, y, foot}, {x + kLegSide, y + kLegSide, kSeatBottom}},
             faces);
    }
  }
}

// Adds the underside of the seat except where the legs meet its corners.
void AddUndersideBetweenLegs(ObjWriter& out, const Placement& placement) {
  const double inner = kHalfSeat - kLegSide;
  const std::array<Rect, 3> parts = {{{-inner, inner, -kHalfSeat, -inner},
                                      {-kHalfSeat, kHalfSeat, -inner, inner},
                                      {-inner, inner, inner, kHalfSeat}}};
  for (const Rect& r : parts) {
    AddBox(out,
           placement,
           {{r.u0, r.v0, kSeatBottom}, {r.u1, r.v1, kSeatTop}},
           kBottomFace);
  }
}

}  // namespace

void AddRect(ObjWriter& out, const AxisPlane& plane, const Rect& r) {
  const std::array<Point3, 4> corners = {PointOn(plane, r.u0, r.v0),
                                         PointOn(plane, r.u1, r.v0),
                                         PointOn(plane, r.u1, r.v1),
                                         PointOn(plane, r.u0, r.v1)};
  // u x v is +x for Axis::kX, -y for kY and +z for kZ.
  if (plane.faces_positive == (plane.axis != Axis::kY)) {
    out.AddPolygon(corners);
  } else {
    out.AddPolygon({corners[3], corners[2], corners[1], corners[0]});
  }
}

void AddPanel(ObjWriter& out,
              const AxisPlane& plane,
              const Rect& rect,
              std::vector<Rect> holes) {
  std::sort(holes.begin(), holes.end(), [](const Rect& a, const Rect& b) {
    return a.u0 < b.u0;
  });
  double u = rect.u0;
  for (const Rect& hole : holes) {
    ENFILADE_CHECK(rect.Contains(hole) && hole.u0 >= u,
                   "a hole [{}, {}] x [{}, {}] off its panel or in another",
                   hole.u0,
                   hole.u1,
                   hole.v0,
                   hole.v1);
    if (hole.u0 > u) {
      AddRect(out, plane, {u, hole.u0, rect.v0, rect.v1});
    }
    if (hole.v0 > rect.v0) {
      AddRect(out, plane, {hole.u0, hole.u1, rect.v0, hole.v0});
    }
    if (hole.v1 < rect.v1) {
      AddRect(out, plane, {hole.u0, hole.u1, hole.v1, rect.v1});
    }
    u = hole.u1;
  }
  if (u < rect.u1) {
    AddRect(out, plane, {u, rect.u1, rect.v0, rect.v1});
  }
}

void AddLining(ObjWriter& out, Axis axis, double a0, double a1, const Rect& o) {
  const Axis u_axis = axis == Axis::kX ? Axis::kY : Axis::kX;
  const Axis v_axis = axis == Axis::kZ ? Axis::kY : Axis::kZ;
  // The two sides normal to u extend along `axis` and v, the two normal to v
  // along `axis` and u. A Rect has the axes of its plane in the order x, y, z.
  const Rect across_u =
      axis == Axis::kZ ? Rect{o.v0, o.v1, a0, a1} : Rect{a0, a1, o.v0, o.v1};
  const Rect across_v =
      axis == Axis::kX ? Rect{a0, a1, o.u0, o.u1} : Rect{o.u0, o.u1, a0, a1};
  AddRect(out, {u_axis, o.u0, true}, across_u);
  AddRect(out, {u_axis, o.u1, false}, across_u);
  AddRect(out, {v_axis, o.v0, true}, across_v);
  AddRect(out, {v_axis, o.v1, false}, across_v);
}

void AddBox(ObjWriter& out,
            const Placement& placement,
            const Box3& box,
            unsigned faces) {
  // Corner i has the high x, y, z where bits 0, 1, 2 of i are set.
  std::array<Point3, 8> corner;
  for (unsigned i = 0; i < 8; ++i) {
    corner[i] = placement.At({(i & 1) != 0 ? box.high.x : box.low.x,
                              (i & 2) != 0 ? box.high.y : box.low.y,
                              (i & 4) != 0 ? box.high.z : box.low.z});
  }
  constexpr std::array<std::array<unsigned, 4>, 6> kCorners = {{{0, 4, 6, 2},
                                                                {1, 3, 7, 5},
                                                                {0, 1, 5, 4},
                                                                {2, 6, 7, 3},
                                                                {0, 2, 3, 1},
                                                                {4, 5, 7, 6}}};
  for (unsigned f = 0; f < kCorners.size(); ++f) {
    if ((faces & (1U << f)) != 0) {
      const auto& c = kCorners[f];
      out.AddPolygon({corner[c[0]], corner[c[1]], corner[c[2]], corner[c[3]]});
    }
  }
}

void AddChair(ObjWriter& out, const Placement& placement, ChairBuild build) {
  const bool closed = build == ChairBuild::kClosed;
  const double back_front = -kHalfSeat + kBackThickness;
  // The top of the seat ends where the back begins, so that the back covers no
  // part of a face.
  AddBox(
      out,
      placement,
      {{-kHalfSeat, back_front, kSeatBottom}, {kHalfSeat, kHalfSeat, kSeatTop}},
      kTopFace);
  const Box3 seat = {{-kHalfSeat, -kHalfSeat, kSeatBottom},
                     {kHalfSeat, kHalfSeat, kSeatTop}};
  AddBox(out, placement, seat, closed ? kSideFaces : kSideFaces | kBottomFace);
  AddBox(out,
         placement,
         {{-kHalfSeat, -kHalfSeat, kSeatTop},
          {kHalfSeat, back_front, kChairHeight}},
         kSideFaces | kTopFace);
  if (closed) {
    AddUndersideBetweenLegs(out, placement);
    AddLegs(out, placement, 0, kChairFootGap, kSideFaces | kBottomFace);
  } else {
    AddLegs(out, placement, 0.01, 0, kSideFaces);
  }
}

}  // namespace enfilade
