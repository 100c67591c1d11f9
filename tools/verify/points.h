// Points on the reflecting patch sides, by their place on one line.
//
// The sides lie end to end on a line of length Area(), in the order of cells
// and patches, each as long as its area. Within a patch, the base-4 digits of
// the fraction of its length pick a quarter of the patch, a quarter of that
// quarter, and so on. For triangles this is the map of Basu & Owen, "Low
// discrepancy constructions in the triangle" (2015). The map preserves areas,
// so points uniform on the line are uniform over the sides, and neighbours on
// the line are near in space.

#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "tools/building_view.h"
#include "tools/verify/geometry.h"

namespace enfilade {

struct SidePoint {
  PatchPoint point;
  Receiver receiver;
  MaterialId material;
  bool emits = false;
};

// Patch coordinates of the point at this fraction, in [0, 1), of the patch's
// stretch of the line.
PatchPoint PlaceOnPatch(PatchShape shape, double fraction);

// The range of fractions of a patch that lie in one of its quarters, a quarter
// of that, and so on.
struct LineStretch {
  double begin = 0;
  double end = 1;
};

LineStretch StretchOnPatch(PatchShape shape, const ElementFrame& part);

class SidePoints {
 public:
  // Reads every cell once; keeps one number per cell.
  explicit SidePoints(const BuildingView& view);

  // Area of the reflecting sides, m2.
  [[nodiscard]] double Area() const { return area_; }

  // The points at these ascending places in [0, Area()). Requires Area() > 0.
  [[nodiscard]] std::vector<SidePoint> At(std::span<const double> places) const;

 private:
  const BuildingView* view_;
  std::vector<double> cell_areas_;
  double area_ = 0;
};

}  // namespace enfilade
