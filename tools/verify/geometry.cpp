#include "tools/verify/geometry.h"

#include "base/photometry.h"

#include <algorithm>
#include <cmath>

#include "tools/verify/lights.h"

namespace enfilade {

void MakeFrame(Vec3 n, Vec3* s, Vec3* t) {
  const double sign = std::copysign(1.0, n.z);
  const double a = -1.0 / (sign + n.z);
  const double b = n.x * n.y * a;
  *s = {1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x};
  *t = {b, sign + n.y * n.y * a, -n.y};
}

Vec3 CosineDirection(Vec3 normal, double u, double v) {
  Vec3 s;
  Vec3 t;
  MakeFrame(normal, &s, &t);
  const double radius = std::sqrt(u);
  const double angle = 2 * kPi * v;
  const double height = std::sqrt(std::max(1e-12, 1 - u));
  return s * (radius * std::cos(angle)) + t * (radius * std::sin(angle)) +
         normal * height;
}

double GeometryTerm(Point3 x, Vec3 normal_x, Point3 y, Vec3 normal_y) {
  const Vec3 d = y - x;
  const double r2 = Dot(d, d);
  const double cos_x = Dot(normal_x, d);
  const double cos_y = -Dot(normal_y, d);
  if (cos_x <= 0 || cos_y <= 0 || r2 <= 0) {
    return 0;
  }
  return cos_x * cos_y / (kPi * r2 * r2);
}

Receiver PointOnEmitter(const Emitter& e, double s, double t) {
  if (e.shape == PatchShape::kTriangle && s + t > 1) {
    s = 1 - s;
    t = 1 - t;
  }
  return {e.origin + e.u * s + e.v * t, e.normal, e.cell};
}

}  // namespace enfilade
