// A mean of random numbers of which very few may be far larger than all others.

#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>

namespace enfilade {

// A mean, and its standard deviation.
struct SampledMean {
  double value = 0;
  double deviation = 0;
};

class OutlierSum {
 public:
  static constexpr size_t kMostOutliers = 4;

  void Add(double x) {
    sum_ += x;
    squares_ += x * x;
    ++count_;
    // The outliers stay in order, the largest first.
    for (double& kept : outliers_) {
      if (std::abs(x) > std::abs(kept)) {
        std::swap(x, kept);
      }
    }
  }

  [[nodiscard]] uint64_t Count() const { return count_; }

  // The mean of all numbers but the `outliers` of largest magnitude; 0 if no
  // number is left.
  [[nodiscard]] SampledMean MeanWithout(size_t outliers) const {
    double sum = sum_;
    double squares = squares_;
    for (size_t i = 0; i < std::min(outliers, kMostOutliers); ++i) {
      sum -= outliers_[i];
      squares -= outliers_[i] * outliers_[i];
    }
    if (count_ <= outliers) {
      return {};
    }
    const auto n = static_cast<double>(count_ - outliers);
    const double mean = sum / n;
    return {mean, std::sqrt(std::max(0.0, squares / n - mean * mean) / n)};
  }

 private:
  double sum_ = 0;
  double squares_ = 0;
  uint64_t count_ = 0;
  std::array<double, kMostOutliers> outliers_{};
};

}  // namespace enfilade
