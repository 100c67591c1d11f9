#include "visibility/cell_part.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace enfilade {
namespace {

constexpr double kMarginMetres = 1e-3;

}  // namespace

CellPart PartOf(const Box3& bounds, const Box3& box) {
  CellPart part;
  const Vec3 extent = bounds.Extent();
  for (size_t axis = 0; axis < 3; ++axis) {
    if (!(extent[axis] > 0)) {
      continue;
    }
    const auto steps = [&](double at) {
      return CellPart::kEnd * (at - bounds.low[axis]) / extent[axis];
    };
    const double low = std::floor(steps(box.low[axis] - kMarginMetres));
    const double high = std::ceil(steps(box.high[axis] + kMarginMetres));
    part.low[axis] =
        static_cast<uint8_t>(std::clamp(low, 0.0, double{CellPart::kEnd}));
    part.high[axis] =
        static_cast<uint8_t>(std::clamp(high, 0.0, double{CellPart::kEnd}));
  }
  return part;
}

Box3 BoxOf(const Box3& bounds, const CellPart& part) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  const auto along = [&](size_t axis, uint8_t steps) {
    return bounds.low[axis] +
           bounds.Extent()[axis] * (double{1} * steps / CellPart::kEnd);
  };
  double low[3];
  double high[3];
  for (size_t axis = 0; axis < 3; ++axis) {
    low[axis] = part.low[axis] == 0 ? -kInfinity : along(axis, part.low[axis]);
    high[axis] = part.high[axis] == CellPart::kEnd
                     ? kInfinity
                     : along(axis, part.high[axis]);
  }
  return {{low[0], low[1], low[2]}, {high[0], high[1], high[2]}};
}

}  // namespace enfilade
