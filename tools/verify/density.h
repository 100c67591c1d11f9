// Where to place points, and how many paths to give each: a density over the
// line of the reflecting sides (points.h), constant on each bin, and a number
// of paths for each class of bins of similar brightness.
//
// With k paths per estimate, E[y^2] (estimate.h) is V + s^4 / k^2. V stems from
// the squared difference and the first-order effect of noise on it; s^2 is the
// variance of one path. The work of a point is k plus a little for the point
// itself, so the best k is s^2 / sqrt(V). The variance of a weighted mean of y
// is least if the density of points is proportional to the root of E[y^2] /
// work (Cochran 1977, section 5.5). Noise is strong where light is: sixteen
// paths suffice on a wall, where the inside of a lamp's shade needs a thousand.
//
// The solution tells beforehand how bright a bin is. A pilot tells V and s^4
// for the bins of similar brightness. A share of the points stays uniform, so
// that no weight exceeds 1 / kUniformShare and light that the solution lacks is
// found.

#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "tools/verify/bins.h"

namespace enfilade {

// What a round measured at a point.
struct PilotValue {
  double product = 0;  // y, unweighted
  double noise = 0;    // variance of an estimate of the radiosity
};

class PointDensity {
 public:
  struct Draw {
    std::vector<double> places;    // ascending, in [0, area)
    std::vector<double> weights;   // uniform density over the drawn one
    std::vector<uint32_t> strata;  // square root of the paths per estimate
  };

  // The bins must cover the line. Apart from the uniform share, the density
  // starts out proportional to the root of the bins' levels.
  explicit PointDensity(std::vector<LightBin> bins);

  // One point in each of `count` strata of equal probability.
  [[nodiscard]] Draw Choose(uint32_t count, uint64_t key) const;

  // Fits the density and the numbers of paths to the values at the drawn places
  // of this call and all earlier ones. Means over points drawn later remain
  // unbiased.
  void Learn(const Draw& draw, std::span<const PilotValue> values);

  // Reduces the numbers of paths until the mean per point is at most `most`:
  // first in classes with very many paths, then in all, down to the least.
  void LimitPaths(double most);

  // The expected paths per estimate of a drawn point.
  [[nodiscard]] double MeanPaths() const;

 private:
  static constexpr size_t kClasses = 24;  // by powers of two of the level

  // Sums over the points of a class so far.
  struct Sums {
    double squares = 0;  // of y
    double noise = 0;    // part of y^2, with the paths that were traced
    double of_path = 0;  // s^4
    double count = 0;

    // The sum of y^2 less the noise.
    [[nodiscard]] double Between() const;

    // s^2 / sqrt(V)
    [[nodiscard]] double BestPaths() const;

    void Add(const Sums& other, double share) {
      squares += share * other.squares;
      noise += share * other.noise;
      of_path += share * other.of_path;
      count += share * other.count;
    }
  };

  template <typename T>
  using ByClass = std::array<T, kClasses>;

  void TakeIn(const Draw& draw, std::span<const PilotValue> values);
  [[nodiscard]] size_t BinAt(double place) const;
  [[nodiscard]] size_t ClassOf(double level) const;
  // `density(bin)` is the learned part of the density, up to a factor.
  template <typename Density>
  void SetMasses(const Density& density);

  double area_;
  double mean_level_ = 0;
  std::vector<LightBin> bins_;
  std::vector<double> masses_;  // probabilities of the bins
  ByClass<double> class_masses_{};
  ByClass<uint32_t> strata_{};
  ByClass<Sums> seen_{};
  Sums weighted_;       // over all points, weighted by w^2
  double squares_ = 0;  // w y^2 of all points so far
  double points_ = 0;
};

}  // namespace enfilade
