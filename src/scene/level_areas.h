// Which way is up: the axis, y or z, to which more area of the scene is level.

#pragma once

#include "base/vec.h"

#include <cmath>

namespace enfilade {

// The area of faces that are level if y is up, and if z is up.
class LevelAreas {
 public:
  // The area vector of a face.
  void Add(const Vec3& area) {
    constexpr double kAlong = 0.99;
    const double size_m2 = Length(area);
    y_m2_ += std::abs(area.y) > kAlong * size_m2 ? size_m2 : 0;
    z_m2_ += std::abs(area.z) > kAlong * size_m2 ? size_m2 : 0;
  }

  // Z is up in a tie.
  [[nodiscard]] bool IsYUp() const { return y_m2_ > z_m2_; }

 private:
  double y_m2_ = 0;
  double z_m2_ = 0;
};

}  // namespace enfilade
