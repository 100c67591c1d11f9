#include "tools/building_view.h"

#include <algorithm>

namespace enfilade {

PatchPoint UniformPointOn(const Patch& patch, double s, double t) {
  PatchPoint point;
  const bool fold = patch.shape == PatchShape::kTriangle && s + t > 1;
  point.a = fold ? 1 - s : s;
  point.b = fold ? 1 - t : t;
  return point;
}

double RayOffset(const Box3& scene_bounds) {
  const double size =
      scene_bounds.IsEmpty() ? 0 : Length(scene_bounds.Extent());
  return std::max(1e-5, 1e-6 * size);
}

}  // namespace enfilade
