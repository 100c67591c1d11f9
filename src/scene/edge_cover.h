// How the edges of a shell run along each other. Where the shell is closed, an
// even number of edges coincide.

#pragma once

#include "scene/figure_cut.h"

#include <optional>
#include <vector>

namespace enfilade {

// A stretch of an edge, by the fractions of the way along it. May go beyond its
// ends.
struct EdgeStretch {
  double low = 0, high = 0;
};

// The stretch of `edge` beside `other`, if the two are parallel and no farther
// apart there than the tolerance (in metres). Requires an edge with a length.
std::optional<EdgeStretch> StretchBeside(const Edge3& edge,
                                         const Edge3& other,
                                         double tolerance);

// The length in metres of those parts of an edge which an odd number of
// stretches cover. Parts no longer than twice the tolerance do not count.
double LengthOfOdd(double edge_length,
                   const std::vector<EdgeStretch>& stretches,
                   double tolerance);

}  // namespace enfilade
