#include "tools/verify/estimate.h"

#include "base/check.h"

#include <algorithm>
#include <cmath>

namespace enfilade {
namespace {

// 97.5 % quantile of the normal distribution.
constexpr double kQuantile = 1.959963984540054;

// y, z and m, weighted.
using Quantities = std::array<double, 3>;

Quantities Evaluate(const ErrorSample& s) {
  Quantities q{};
  for (size_t c = 0; c < kRgbChannels; ++c) {
    const double r1 = s.reflectance[c] * s.irradiance1[c];
    const double r2 = s.reflectance[c] * s.irradiance2[c];
    const double reflected = s.radiosity[c] - s.exitance[c];
    q[0] += (r1 - reflected) * (r2 - reflected) / kRgbChannels;
    q[1] += (r1 + r2) / 2 / kRgbChannels;
    q[2] += (reflected - (r1 + r2) / 2) / kRgbChannels;
  }
  for (double& value : q) {
    value *= s.weight;
  }
  return q;
}

}  // namespace

double ProductOfDifferences(const ErrorSample& sample) {
  ErrorSample unweighted = sample;
  unweighted.weight = 1;
  return Evaluate(unweighted)[0];
}

double NoiseVariance(const ErrorSample& sample) {
  double sum = 0;
  for (size_t c = 0; c < kRgbChannels; ++c) {
    const double difference =
        sample.reflectance[c] * (sample.irradiance1[c] - sample.irradiance2[c]);
    sum += difference * difference / 2 / kRgbChannels;
  }
  return sum;
}

void ErrorEstimate::AddRound(std::span<const ErrorSample> samples) {
  ENFILADE_CHECK(samples.size() >= 2, "{} samples", samples.size());
  // The last of an odd number of samples is paired with its neighbour, which
  // then counts in two pairs. The variance becomes too large by at most a third
  // if the strata have equal variances.
  std::vector<Quantities> all;
  all.reserve(samples.size());
  for (const ErrorSample& s : samples) {
    all.push_back(Evaluate(s));
  }
  for (const Quantities& q : all) {
    for (size_t i = 0; i < kQuantities; ++i) {
      sums_[i] += q[i];
    }
    largest_ = std::max(largest_, q[kSquare]);
  }
  for (size_t k = 0; k < all.size(); k += 2) {
    const size_t partner = k + 1 < all.size() ? k + 1 : k - 1;
    for (size_t i = 0; i < kQuantities; ++i) {
      for (size_t j = 0; j < kQuantities; ++j) {
        pairs_[i][j] +=
            (all[k][i] - all[partner][i]) * (all[k][j] - all[partner][j]);
      }
    }
  }
  count_ += all.size();
}

double ErrorEstimate::Mean(Quantity q) const {
  return count_ > 0 ? sums_[q] / static_cast<double>(count_) : 0;
}

// For a pair of strata of equal probability, E (a - b)^2 is the sum of their
// variances plus the square of the difference of their means, so the estimate
// is too large rather than too small.
double ErrorEstimate::Covariance(Quantity p, Quantity q) const {
  const auto n = static_cast<double>(count_);
  return pairs_[p][q] / (n * n);
}

double ErrorEstimate::MeanReflected() const {
  return Mean(kReflected);
}

Interval ErrorEstimate::Error() const {
  const double y = Mean(kSquare);
  const double z = Mean(kReflected);
  const double ratio = y / (z * z);
  // The variance of y/z^2, linearised: dy / z^2 - 2 y dz / z^3.
  const double variance =
      (Covariance(kSquare, kSquare) -
       4 * ratio * z * Covariance(kSquare, kReflected) +
       4 * ratio * ratio * z * z * Covariance(kReflected, kReflected)) /
      (z * z * z * z);
  const double deviation = std::sqrt(std::max(0.0, variance));
  // The upper end allows for one more point like the largest. The upper limit
  // of a count does the same (Garwood 1936), and the sum is such a count if
  // points contribute all or nothing.
  const double more = largest_ / (static_cast<double>(count_) * z * z);
  const auto root = [](double x) { return std::sqrt(std::max(0.0, x)); };
  // Noise can make the estimate of a square negative, although no square is.
  return {root(ratio),
          root(ratio - kQuantile * deviation),
          root(std::max(ratio, 0.0) + more +
               kQuantile * std::hypot(deviation, more))};
}

Interval ErrorEstimate::Deviation() const {
  const double z = Mean(kReflected);
  const double ratio = Mean(kSigned) / z;
  const double variance = (Covariance(kSigned, kSigned) -
                           2 * ratio * Covariance(kSigned, kReflected) +
                           ratio * ratio * Covariance(kReflected, kReflected)) /
                          (z * z);
  const double half = kQuantile * std::sqrt(std::max(0.0, variance));
  return {ratio, ratio - half, ratio + half};
}

}  // namespace enfilade
