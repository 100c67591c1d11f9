#include "solver/semi_iteration.h"

#include <algorithm>
#include <cmath>

namespace enfilade {
namespace {

constexpr double kLargestRadius = 0.99;

}  // namespace

double SemiIteration::NextWeight() {
  if (steps_ == 0) {
    weight_ = 1;
  } else if (steps_ == 1) {
    weight_ = 1 / (1 - 0.5 * radius_ * radius_);
  } else {
    weight_ = 1 / (1 - 0.25 * radius_ * radius_ * weight_);
  }
  ++steps_;
  return weight_;
}

void SemiIteration::Saw(double unsent) {
  early_ = steps_ == 2 ? unsent : early_;
  last_ = unsent;
}

double SemiIteration::LearntRadius() const {
  if (steps_ < 4 || !(early_ > 0)) {
    return radius_;
  }
  const double seen = std::pow(last_ / early_, 1.0 / (steps_ - 2));
  // Per step, components with eigenvalues up to the radius fall by `expected`.
  // A component whose eigenvalue is radius (z + 1/z) / 2 falls by z times
  // `expected`.
  const double expected = radius_ / (1 + std::sqrt(1 - radius_ * radius_));
  const double z = seen / expected;
  return z > 1 ? std::min(kLargestRadius, 0.5 * radius_ * (z + 1 / z))
               : radius_;
}

}  // namespace enfilade
