// Convex planar polygons: the basic geometry of the partition. They are
// counter-clockwise seen from their front. Lengths and tolerances are in
// metres.

#pragma once

#include "base/planar_polygon.h"
#include "base/plane.h"
#include "base/vec.h"

#include <cstdint>
#include <functional>
#include <vector>

namespace enfilade {

using Polygon = std::vector<Point3>;

// A face within this distance of a plane counts as lying in the plane: in files
// that round to a tenth of a millimetre, two faces of one wall are at most this
// far apart. The distance is also half the width of the cracks between faces
// that count as closed, which is less than a ray can be trusted to find.
inline constexpr double kOnPlaneM = 1e-4;
inline constexpr double kCrackM = 2 * kOnPlaneM;

// A computed vertex (a corner of a region or an opening) within this distance
// of a plane counts as lying in the plane.
inline constexpr double kRoundingM = 1e-7;

// A polygon is planar if its vertices lie this close to its plane.
inline constexpr double kPlanarM = 2e-6;

// Pieces of less area are rounding errors.
inline constexpr double kLeastAreaM2 = 1e-10;

// The plane of a polygon of nonzero area, through the mean of its vertices; the
// plane's front is the polygon's front. A normal that is an axis up to rounding
// becomes exactly that axis.
Plane PlaneOf(const Polygon& polygon);

// The plane through an edge of a polygon with this unit normal, upright on it.
// The polygon is in front.
Plane EdgePlane(Point3 from, Point3 to, Vec3 normal);

// The polygon itself if its vertices lie in one plane up to kPlanarM, otherwise
// triangles.
std::vector<Polygon> PlanarParts(const Polygon& polygon);

// Where a polygon lies with respect to a plane: kOn if all its vertices are
// within the tolerance, otherwise kFront, kBack or kCut.
enum class PlaneSide { kOn, kFront, kBack, kCut };
PlaneSide Classify(const Polygon& polygon,
                   const Plane& plane,
                   double tolerance_m);

struct SplitPolygons {
  Polygon front;
  Polygon back;
};

// Cuts a polygon that Classify calls kCut with the same tolerance. Both parts
// share the vertices within the tolerance, unless a whole edge lies within it.
// If two polygons share an edge, cutting each of them gives the same point of
// that edge.
SplitPolygons Split(const Polygon& polygon,
                    const Plane& plane,
                    double tolerance_m);

// The part of the polygon in front of (or on) the plane; may be empty.
Polygon ClipToFront(const Polygon& polygon,
                    const Plane& plane,
                    double tolerance_m);

// A rectangle in `plane` around the box.
Polygon RectangleAround(const Box3& box, const Plane& plane);

// Removes `covers` (convex polygons in the plane of `polygon`, facing either
// way) from the polygon and returns the rest as convex polygons. Gaps of less
// than kCrackM between covers close; gaps across which no axis leads, if they
// are less than `oblique_crack_m`. Many covers make many pieces: as the pieces
// grow, `grow`, unless empty, is told their bytes and the share of the covers
// that were removed so far.
std::vector<Polygon> Subtract(
    const Polygon& polygon,
    const Vec3& normal,
    const std::vector<const Polygon*>& covers,
    double oblique_crack_m = kCrackM,
    const std::function<void(uint64_t bytes, double share)>& grow = {});

// The polygon without the vertices that lie on the line through their
// neighbours or on top of them; empty if the rest has no area.
Polygon WithoutStraightCorners(const Polygon& polygon);

// The convex hull of points that lie in a plane of the given normal,
// counter-clockwise seen from the normal's tip. Empty if they are collinear.
Polygon ConvexHull(const std::vector<Point3>& points, const Vec3& normal);

}  // namespace enfilade
