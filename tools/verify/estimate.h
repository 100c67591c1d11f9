// The error of a solution from samples of it and of a noisy reference, without
// bias from the noise. Derivation: docs/error-measure.md.
//
// Notation, at a point x of the reflecting sides, channel means over 3
//   B        radiosity of the solution at x
//   X1, X2   two independent unbiased estimates of the true radiosity at x
//   R1, R2   the same of the true reflected radiosity (radiosity - emission)
//   y        mean (X1 - B)(X2 - B): its expectation is the squared difference
//   z        mean (R1 + R2) / 2:    its expectation is reflected radiosity
//   m        mean B - (X1 + X2)/2:  its expectation is the signed difference
//   w        uniform density over that of the point; all means are of w times
//            the quantity
//   error    sqrt(mean y) / mean z; W eq. 11

#pragma once

#include "base/photometry.h"

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace enfilade {

// What is known at one point. Radiosity X = exitance + reflectance * H.
struct ErrorSample {
  Rgb reflectance{};
  Rgb exitance{};
  Rgb irradiance1{};  // H, W/m2: independent estimates
  Rgb irradiance2{};
  Rgb radiosity{};    // of the solution
  double weight = 1;  // uniform density over that of the point
};

// y of a sample, unweighted: the product of the two differences.
double ProductOfDifferences(const ErrorSample& sample);

// Estimated variance of X1, and likewise of X2: the mean over the channels,
// unweighted.
double NoiseVariance(const ErrorSample& sample);

struct Interval {
  double value = 0;
  double low = 0;
  double high = 0;
};

// Sums over points that are stratified with one point to a stratum, all strata
// of equal probability. Rounds of independent points may be added one after
// another.
class ErrorEstimate {
 public:
  // Adds a round of at least two samples, in the order of their strata, so that
  // neighbours in the order are neighbours in space.
  void AddRound(std::span<const ErrorSample> samples);

  [[nodiscard]] uint64_t Points() const { return count_; }

  // The sum of w y; noise can make it negative.
  [[nodiscard]] double SumOfSquares() const { return sums_[kSquare]; }

  // Mean reflected radiosity of the reference.
  [[nodiscard]] double MeanReflected() const;

  // Relative error and relative signed deviation, with 95 % intervals. The
  // upper end of Error() allows for one more point like the largest. Both
  // require a positive MeanReflected().
  [[nodiscard]] Interval Error() const;
  [[nodiscard]] Interval Deviation() const;

 private:
  enum Quantity : size_t { kSquare, kReflected, kSigned, kQuantities };

  [[nodiscard]] double Mean(Quantity q) const;
  // Covariance of the means of two quantities.
  [[nodiscard]] double Covariance(Quantity p, Quantity q) const;

  uint64_t count_ = 0;
  std::array<double, kQuantities> sums_{};
  // Sums over pairs of neighbours of products of differences.
  std::array<std::array<double, kQuantities>, kQuantities> pairs_{};
  double largest_ = 0;  // largest w y of all points
};

}  // namespace enfilade
