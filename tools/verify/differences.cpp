#include "tools/verify/differences.h"

#include <algorithm>
#include <functional>
#include <utility>

namespace enfilade {

bool LargestDifferences::Wants(double part) const {
  return part > 0 && (points_.size() < kMost || part > points_.back().share);
}

void LargestDifferences::Add(DifferingPoint point) {
  const auto place = std::upper_bound(
      points_.begin(), points_.end(), point, [](const auto& a, const auto& b) {
        return a.share > b.share;
      });
  points_.insert(place, std::move(point));
  if (points_.size() > kMost) {
    points_.pop_back();
  }
}

std::vector<DifferingPoint> LargestDifferences::SharesOf(double sum) const {
  if (!(sum > 0)) {
    return {};
  }
  std::vector<DifferingPoint> points = points_;
  for (DifferingPoint& p : points) {
    p.share /= sum;
  }
  return points;
}

}  // namespace enfilade
