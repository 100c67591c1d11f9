// Where points are worth their rays: a density over the line of the reflecting
// sides (verify_points.h), constant on bins.
//
// The variance of a weighted mean of y is least with points in proportion to
// the root of E[y^2] (Cochran 1977, section 5.5). What is known before: how
// bright the solution says a bin is. What a pilot tells: the mean of y^2 among
// bins about as bright. A share of the points stays uniform, so that no weight
// exceeds 1 / kUniformShare and light that the solution lacks is found.

#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "tools/verify_bins.h"

namespace enfilade {

class PointDensity {
 public:
  struct Draw {
    std::vector<double> places;   // ascending, in [0, area)
    std::vector<double> weights;  // uniform density over this one
  };

  // The bins cover the line. Starts with points in proportion to the root of
  // their levels.
  explicit PointDensity(std::vector<LightBin> bins);

  // One point in each of `count` strata of equal probability.
  [[nodiscard]] Draw Choose(uint32_t count, uint64_t key) const;

  // Fits the density to pilot values at drawn places.
  void Learn(const Draw& draw, std::span<const double> values);

 private:
  static constexpr size_t kClasses = 24;  // by powers of two of the level

  [[nodiscard]] size_t BinAt(double place) const;
  [[nodiscard]] size_t ClassOf(double level) const;
  // `density`: of the points that are not uniform, up to a factor.
  template <typename Density>
  void SetMasses(const Density& density);

  double area_;
  double mean_level_ = 0;
  std::vector<LightBin> bins_;
  std::vector<double> masses_;  // probabilities of the bins
};

}  // namespace enfilade
