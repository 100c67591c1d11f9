// The points, of all that are measured, where a solution differs most from the
// reference.

#pragma once

#include <cstddef>
#include <vector>

#include "tools/verify/verify.h"

namespace enfilade {

// Keeps the points with the largest parts in the sum of squares, the largest
// first.
class LargestDifferences {
 public:
  // Whether a point with this part in the sum of squares would be kept.
  [[nodiscard]] bool Wants(double part) const;

  // Adds a point whose `share` is its part in the sum of squares, because the
  // sum is not known yet.
  void Add(DifferingPoint point);

  // The kept points, their parts divided by `sum`, the sum over all points;
  // none if noise makes that 0 or less.
  [[nodiscard]] std::vector<DifferingPoint> SharesOf(double sum) const;

 private:
  static constexpr size_t kMost = 16;

  std::vector<DifferingPoint> points_;
};

}  // namespace enfilade
