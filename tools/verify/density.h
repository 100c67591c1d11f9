// Where points are worth their rays, and how many paths each: a density over
// the line of the reflecting sides (points.h), constant on bins, and a
// number of paths for each class of bins about as bright.
//
// With k paths per estimate the expectation of y^2 (estimate.h) is
// V + s^4 / k^2: V of the squared difference and what noise makes of it in the
// first order, s^2 the variance of one path. The work of a point is k and a
// little for the point itself, so k = s^2 / sqrt(V), and the variance of a
// weighted mean of y is least with points in proportion to the root of
// E[y^2] / work (Cochran 1977, section 5.5). Noise is where light is: sixteen
// paths do for a wall where the inside of a lamp's shade wants a thousand.
//
// What is known before: how bright the solution says a bin is. What a pilot
// tells: V and s^4 among bins about as bright. A share of the points stays
// uniform, so that no weight exceeds 1 / kUniformShare and light that the
// solution lacks is found.

#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "tools/verify/bins.h"

namespace enfilade {

// What a pilot saw at a point.
struct PilotValue {
  double product = 0;  // y, unweighted
  double noise = 0;    // variance of an estimate of the radiosity
};

class PointDensity {
 public:
  struct Draw {
    std::vector<double> places;    // ascending, in [0, area)
    std::vector<double> weights;   // uniform density over this one
    std::vector<uint32_t> strata;  // the root of the paths per estimate
  };

  // The bins cover the line. Starts with points in proportion to the root of
  // their levels.
  explicit PointDensity(std::vector<LightBin> bins);

  // One point in each of `count` strata of equal probability.
  [[nodiscard]] Draw Choose(uint32_t count, uint64_t key) const;

  // Fits the density and the numbers of paths to what was seen at drawn places,
  // and at those of earlier calls. Means over points drawn later are as
  // unbiased as before.
  void Learn(const Draw& draw, std::span<const PilotValue> values);

  // Fewer paths, so that points have no more than `most` in the mean: first
  // where they are very many, then everywhere down to the least.
  void LimitPaths(double most);

  // Per estimate, expected of a drawn point.
  [[nodiscard]] double MeanPaths() const;

 private:
  static constexpr size_t kClasses = 24;  // by powers of two of the level

  // Over the points of a class so far.
  struct Sums {
    double squares = 0;  // of y
    double noise = 0;    // of y^2, as many paths as there were
    double of_path = 0;  // s^4
    double count = 0;

    // What of the sum of y^2 is no noise.
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
  // `density`: of the points that are not uniform, up to a factor.
  template <typename Density>
  void SetMasses(const Density& density);

  double area_;
  double mean_level_ = 0;
  std::vector<LightBin> bins_;
  std::vector<double> masses_;  // probabilities of the bins
  ByClass<double> class_masses_{};
  ByClass<uint32_t> strata_{};
  ByClass<Sums> seen_{};
  Sums weighted_;       // of all points, w^2 times
  double squares_ = 0;  // w y^2 of all points so far
  double points_ = 0;
};

}  // namespace enfilade
