#include "tools/building_view.h"

#include <algorithm>
#include <tuple>

namespace enfilade {

PatchPoint UniformPointOn(const Patch& patch, double s, double t) {
  PatchPoint point;
  std::tie(point.a, point.b) = FoldedOnto(patch.shape, s, t);
  return point;
}

double RayOffset(const Box3& scene_bounds) {
  const double size =
      scene_bounds.IsEmpty() ? 0 : Length(scene_bounds.Extent());
  return std::max(1e-5, 1e-6 * size);
}

}  // namespace enfilade
