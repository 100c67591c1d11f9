// Combines the probes of the residual into the error of the solution and its
// confidence interval, and decides whether more probes are needed.
//
// The integral of e^2 is the integral of r^2, which each probe estimates, plus
// what reflection adds to it (reflected_error.h), both in W^2/m2. Very few
// probes may hold nearly all of r^2 (outlier_sum.h). This file knows no rays
// and no store; residual_check measures the probes.

#pragma once

#include "base/photometry.h"
#include "solver/residual/outlier_sum.h"
#include "solver/residual/reflected_error.h"

#include <cstdint>

namespace enfilade {

// Relative RMS of the error over the reflecting sides, and its 95 % interval.
struct ResidualEstimate {
  double value = 0;
  double low = 0;
  double high = 0;
  // Another estimate of the error is believed if it is between `least` and
  // `most`. `least` is the value if the value is certainly above 0, else the
  // value of all points but a few that alone make it uncertain. `most` is one
  // standard deviation above the value and not below `least`.
  double least = 0;
  double most = 0;
  uint64_t points = 0;
  uint64_t rays = 0;
  // The share of the area that would have all light if that were even there:
  // (integral of B)^2 / (area * integral of B^2) of the reflected radiosity.
  double lit_share = 1;
};

// The error that no probe sees, as a share of the error that probes see: errors
// within a group of surface that come back by reflection.
struct UnseenError {
  double always = 0;
  // Multiplied by the share of light that a bounce leaves, averaged over the
  // surfaces and weighted by how far their hemispheres are enclosed.
  double per_bounce = 0;
};

// Measured; see docs/decisions/residual-check.md. With a constant basis, probes
// also do not see what reflection makes of the slopes that the basis lacks.
inline constexpr UnseenError kUnseenError = {0.05, 0.2};
inline constexpr UnseenError kUnseenErrorOfConstants = {0.05, 0.75};

// Converts the integral of e^2 into a relative RMS error.
struct ErrorScale {
  double mean_reflected = 1;   // W/m2: the error is relative to it
  double reflecting_area = 0;  // m2; both over all reflecting sides
  UnseenError unseen;
};

// The measurements of one probe.
struct ProbeResidual {
  double weight = 0;    // m2: area of the probe, times all probes
  double square = 0;    // r^2 without bias, mean of the channels, (W/m2)^2
  double enclosed = 0;  // share of its hemisphere that surfaces fill
  Rgb reflectance{};
};

class ResidualSum {
 public:
  explicit ResidualSum(const ErrorScale& scale) : scale_(scale) {}

  void Add(const ProbeResidual& probe);

  // The estimate of all probes so far, which took `rays` rays. `reflected` is
  // the integral of e^2 - r^2 from the same probes.
  [[nodiscard]] ResidualEstimate Estimate(const ErrorIntegral& reflected,
                                          uint64_t rays) const;

 private:
  [[nodiscard]] double CertainPart() const;
  [[nodiscard]] double UnseenPerSeen() const;

  ErrorScale scale_;
  OutlierSum squares_;  // weighted
  // Sums over the probes, m2. `seen_area_` sums the weight times the enclosed
  // share of the hemisphere, `reflected_area_` the weight times the square of
  // that share and the reflectance.
  double seen_area_ = 0;
  double reflected_area_ = 0;
};

// The fewest rays after which the error may be decided to be below or above a
// value.
struct DecidingRays {
  // For the decision "below": few points may see no error at all, and then
  // their interval is falsely narrow.
  uint64_t below = 0;
  // For the decision "above", and for which patches it is above.
  uint64_t above = 0;
};

// Whether the interval excludes `decide_at` after enough rays, or is narrow:
// more probes would change nothing.
bool IsDecided(const ResidualEstimate& estimate,
               double decide_at,
               DecidingRays least);

}  // namespace enfilade
