// Finds a vector on the positive side of every row: the linear test behind
// portal stabbing. Internal to src/visibility.
//
// Notation (Plücker coordinates; Teller, PhD thesis, 1992):
//   line through o with direction d:    L = (d, o x d), 6 numbers
//   oriented edge from p to q:          a = (p x q, q - p), 6 numbers
//   a . L > 0: the line passes the edge on its left, seen against d
// A line crosses a convex polygon along the polygon's normal if the line passes
// all counter-clockwise edges on their left. The vectors L = (d, m) of real
// lines also satisfy d . m = 0; leaving this quadric out only adds lines.

#pragma once

#include "base/vec.h"

#include <array>
#include <optional>
#include <span>

namespace enfilade {

using PluckerRow = std::array<double, 6>;

double Dot(const PluckerRow& a, const PluckerRow& b);

// The row of the edge from p to q, of length 1. Requires p != q.
PluckerRow EdgeRow(Point3 p, Point3 q);

// A vector with a . L > 0 for all rows, or nullopt if the cone of such vectors
// is empty or narrower than about 1e-7. Rows have length 1; there is at least
// one. Finds the point of the rows' convex hull that is nearest to the origin
// (Wolfe, Finding the nearest point in a polytope, 1976): the rows all lie
// strictly on one side of a plane through the origin unless that point is the
// origin itself.
// On numerical trouble, returns a vector and never nullopt.
std::optional<PluckerRow> InteriorOfCone(std::span<const PluckerRow> rows);

}  // namespace enfilade
