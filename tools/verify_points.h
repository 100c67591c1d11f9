// Points on the reflecting patch sides, stratified over their area.

#pragma once

#include <cstdint>
#include <vector>

#include "tools/building_view.h"
#include "tools/verify_paths.h"

namespace enfilade {

struct SidePoint {
  PatchPoint point;
  Receiver receiver;
  MaterialId material;
  bool emits = false;
};

// A side that reflects some light in some channel.
bool Reflects(const SceneInfo& scene, const Patch& patch);

class SidePoints {
 public:
  // Reads every cell once; keeps one number per cell.
  explicit SidePoints(const BuildingView& view);

  // Area of the reflecting sides, m2.
  [[nodiscard]] double Area() const { return area_; }

  // `count` points, one uniform in each of `count` strata of equal area, in
  // the order of cells and patches. Requires Area() > 0.
  [[nodiscard]] std::vector<SidePoint> Choose(uint32_t count,
                                              uint64_t key) const;

 private:
  const BuildingView* view_;
  std::vector<double> cell_areas_;
  double area_ = 0;
};

}  // namespace enfilade
