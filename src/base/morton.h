// The Morton curve: an order of points in which neighbours are mostly near each
// other in space.

#pragma once

#include "base/vec.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>

namespace enfilade {

// The place of a point on the Morton curve through the cube at the box's lowest
// corner that holds the box, with 21 bits for each axis. In a cube the curve's
// parts are compact even if the box is long and narrow. A point outside the
// cube has the place of the nearest one in it.
inline uint64_t MortonCode(Point3 p, const Box3& box) {
  constexpr uint64_t kSteps = 0x1fffff;
  const Vec3 extent = box.Extent();
  const double side = std::max({extent.x, extent.y, extent.z});
  const Vec3 from_low = p - box.low;
  uint64_t code = 0;
  for (size_t axis = 0; axis < 3; ++axis) {
    const double f =
        side > 0 ? std::clamp(from_low[axis] / side, 0.0, 1.0) : 0.0;
    // Puts two zero bits between each two bits of x.
    auto x = static_cast<uint64_t>(f * kSteps);
    x = (x | x << 32) & 0x1f00000000ffff;
    x = (x | x << 16) & 0x1f0000ff0000ff;
    x = (x | x << 8) & 0x100f00f00f00f00f;
    x = (x | x << 4) & 0x10c30c30c30c30c3;
    x = (x | x << 2) & 0x1249249249249249;
    code |= x << axis;
  }
  return code;
}

}  // namespace enfilade
