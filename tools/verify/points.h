// Points on the reflecting patch sides, by their place on one line.
//
// The sides lie end to end on a line of length Area(), in the order of cells
// and patches, each as long as its area. Within a patch, the digits to base 4
// of the fraction of its length pick a quarter of it, a quarter of that, and so
// on: for triangles the map of Basu & Owen, "Low discrepancy constructions in
// the triangle" (2015). It keeps areas, so what is uniform on the line is
// uniform over the sides, and neighbours on the line are near in space.

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

// A side that reflects some light in some channel.
bool Reflects(const SceneInfo& scene, const Patch& patch);

// Patch coordinates of the place at a fraction in [0, 1) of a patch.
PatchPoint PlaceOnPatch(PatchShape shape, double fraction);

// The fractions of a patch whose places lie in one of its quarters, quarters of
// those and so on.
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
