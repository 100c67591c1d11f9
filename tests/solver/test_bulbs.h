// Bulbs for the tests of lamps: closed convex bodies of small facets.

#pragma once

#include "base/photometry.h"
#include "base/vec.h"
#include "partition/patch.h"

#include <cmath>
#include <vector>

namespace enfilade::test {

// A body inscribed in a ball: 2 n slices in longitude, n in latitude, as
// triangles that face outwards and emit.
inline std::vector<Patch> Bulb(Point3 center, double radius, int n) {
  const auto at = [&](int latitude, int longitude) {
    const double theta = kPi * latitude / n;
    const double phi = kPi * longitude / n;
    return center + Vec3{std::sin(theta) * std::cos(phi),
                         std::sin(theta) * std::sin(phi),
                         std::cos(theta)} *
                        radius;
  };
  std::vector<Patch> facets;
  const auto add = [&](Point3 a, Point3 b, Point3 c) {
    Patch p;
    p.shape = PatchShape::kTriangle;
    p.emits = true;
    p.origin = a;
    p.u = b - a;
    p.v = c - a;
    facets.push_back(p);
  };
  for (int i = 0; i < n; ++i) {
    for (int k = 0; k < 2 * n; ++k) {
      if (i > 0) {
        add(at(i, k), at(i + 1, k), at(i, k + 1));
      }
      if (i + 1 < n) {
        add(at(i + 1, k), at(i + 1, k + 1), at(i, k + 1));
      }
    }
  }
  return facets;
}

}  // namespace enfilade::test
