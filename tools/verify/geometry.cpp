#include "tools/verify/geometry.h"

#include "partition/patch_points.h"

#include <cmath>

#include "tools/verify/lights.h"

namespace enfilade {

NormalAxes MakeFrame(Vec3 n) {
  const double sign = std::copysign(1.0, n.z);
  const double a = -1.0 / (sign + n.z);
  const double b = n.x * n.y * a;
  return {{1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x},
          {b, sign + n.y * n.y * a, -n.y},
          n};
}

Vec3 CosineDirection(Vec3 normal, double u, double v) {
  return MakeFrame(normal).CosineDirection(u, v);
}

Receiver PointOnEmitter(const Emitter& e, double s, double t) {
  const auto [a, b] = FoldedOnto(e.shape, s, t);
  return {PointOn(e, a, b), e.normal, e.cell};
}

}  // namespace enfilade
