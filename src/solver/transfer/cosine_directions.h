// Random directions about the normal of a patch, cosine-distributed.

#pragma once

#include "base/random.h"
#include "solver/elements/geometry.h"

namespace enfilade {

// A point of the unit circle.
struct CirclePoint {
  double cosine = 0;
  double sine = 0;
};

// The point at the fraction t of a turn, 0 <= t <= 1, accurate to 1e-11.
CirclePoint OnCircle(double t);

class CosineDirections {
 public:
  explicit CosineDirections(const PatchGeometry& patch)
      : axes_(AxesOf(patch)) {}

  Vec3f Draw(Random* random) const;

 private:
  PatchAxes axes_;
};

}  // namespace enfilade
