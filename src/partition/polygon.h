// Convex planar polygons and planes: the exact small geometry of the partition.
//
// Notation: a plane is { x : n . x = offset }, |n| = 1; its front is where
// n . x > offset. Polygons are convex, planar, and counter-clockwise seen from
// their front. Lengths and tolerances are in metres.

#pragma once

#include "base/packed.h"
#include "base/vec.h"

#include <cstdint>
#include <functional>
#include <vector>

namespace enfilade {

using Polygon = std::vector<Point3>;

// Within this distance a face counts as lying in a plane: files that round to a
// tenth of a millimetre bring two faces of one wall no farther apart. It is
// also half the width of the cracks between faces that are taken for closed,
// less than a ray can be trusted to find.
inline constexpr double kOnPlaneM = 1e-4;
inline constexpr double kCrackM = 2 * kOnPlaneM;

// Within this distance a vertex that was computed (a corner of a region or an
// opening) counts as lying in a plane.
inline constexpr double kRoundingM = 1e-7;

// The vertices of a polygon that is called planar lie this close to its plane.
inline constexpr double kPlanarM = 2e-6;

// Pieces of less area are nothing but rounding.
inline constexpr double kLeastAreaM2 = 1e-10;

struct Plane {
  Vec3 normal;
  double offset = 0;

  [[nodiscard]] double Distance(Point3 p) const {
    return Dot(normal, Vec3{p.x, p.y, p.z}) - offset;
  }

  [[nodiscard]] Plane Flipped() const { return {-normal, -offset}; }
};

template <>
inline constexpr bool kIsPacked<Plane> = kIsPacked<Vec3> &&
                                         sizeof(Plane) ==
                                             sizeof(Vec3) + sizeof(double);

// The plane of a polygon of nonzero area, through its centroid, front to front.
// A normal that is an axis up to rounding is made exactly that axis.
Plane PlaneOf(const Polygon& polygon);

// The polygon, if its vertices lie in one plane up to kPlanarM, else triangles.
std::vector<Polygon> PlanarParts(const Polygon& polygon);

double PolygonArea(const Polygon& polygon);

// How far something reaches along an axis, from the origin.
struct AxisRange {
  double low = 0, high = 0;
};

AxisRange RangeAlong(const Polygon& polygon, const Vec3& axis);

// Where a polygon lies with respect to a plane: `on` if all its vertices are
// within the tolerance, else on one side, or cut.
enum class PlaneSide { kOn, kFront, kBack, kCut };
PlaneSide Classify(const Polygon& polygon,
                   const Plane& plane,
                   double tolerance_m);

struct SplitPolygons {
  Polygon front;
  Polygon back;
};

// Cuts a polygon that Classify calls kCut with the same tolerance: vertices
// within it are shared by both parts, unless an edge lies within it. Cutting
// two polygons that share an edge gives the same point of that edge.
SplitPolygons Split(const Polygon& polygon,
                    const Plane& plane,
                    double tolerance_m);

// The part of the polygon in front of (or on) the plane; may be empty.
Polygon ClipToFront(const Polygon& polygon,
                    const Plane& plane,
                    double tolerance_m);

// A rectangle in `plane` around the box.
Polygon RectangleAround(const Box3& box, const Plane& plane);

// Removes `covers` (convex polygons that lie in the plane of `polygon`, facing
// either way) from the polygon: what is left, as convex polygons. Gaps of less
// than kCrackM between covers close. Of many covers are many pieces: what those
// take is told to `grow`, unless that is empty, as it grows, and what share of
// the covers they are of.
std::vector<Polygon> Subtract(
    const Polygon& polygon,
    const Vec3& normal,
    const std::vector<const Polygon*>& covers,
    const std::function<void(uint64_t bytes, double share)>& grow = {});

// Without the vertices that lie on the line through their neighbours or on top
// of them; empty if nothing with an area is left.
Polygon WithoutStraightCorners(const Polygon& polygon);

// The convex hull of points that lie in a plane of the given normal,
// counter-clockwise seen from the normal's tip. Empty if they are collinear.
Polygon ConvexHull(const std::vector<Point3>& points, const Vec3& normal);

}  // namespace enfilade
