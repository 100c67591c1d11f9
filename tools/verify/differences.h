// Where a solution differs most from the reference, of all that is looked at.

#pragma once

#include <cstddef>
#include <vector>

#include "tools/verify/verify.h"

namespace enfilade {

// The points that count most, the largest first.
class LargestDifferences {
 public:
  // Whether a point of this part in the sum of squares is among them.
  [[nodiscard]] bool Wants(double part) const;

  // A point's share is its part until all are known.
  void Add(DifferingPoint point);

  // Their shares in the sum of all points.
  [[nodiscard]] std::vector<DifferingPoint> SharesOf(double sum) const;

 private:
  static constexpr size_t kMost = 16;

  std::vector<DifferingPoint> points_;
};

}  // namespace enfilade
