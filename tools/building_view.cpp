#include "tools/building_view.h"

namespace enfilade {

PatchPoint UniformPointOn(const Patch& patch, double s, double t) {
  PatchPoint point;
  const bool fold = patch.shape == PatchShape::kTriangle && s + t > 1;
  point.a = fold ? 1 - s : s;
  point.b = fold ? 1 - t : t;
  return point;
}

}  // namespace enfilade
