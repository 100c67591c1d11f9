// What the probes of the residual say together: the error of the solution, how
// sure that is, and whether more of them are needed.
//
// The integral of e^2 is that of r^2, of which each probe is an estimate, and
// what reflection adds to it (reflected_error.h), both in W^2/m2. Of r^2 very
// few probes may hold nearly all (outlier_sum.h). Knows no rays and no store:
// residual_check measures, this counts.

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
  // Between which another estimate of the error is believed: the value, if
  // there is any error to be seen at all (or by all points but a few, where
  // these alone make the value uncertain), and one standard deviation above it.
  double least = 0;
  double most = 0;
  uint64_t points = 0;
  uint64_t rays = 0;
};

// What no probe sees, over what they see: errors within a group of surface that
// come back by reflection.
struct UnseenError {
  double always = 0;
  // Times the share of the light that a bounce leaves, in the mean over all
  // that anything is seen from.
  double per_bounce = 0;
};

// Measured: docs/decisions/residual-check.md. What the slopes that a constant
// basis lacks become on their way is not seen either.
inline constexpr UnseenError kUnseenError = {0.05, 0.2};
inline constexpr UnseenError kUnseenErrorOfConstants = {0.05, 0.75};

// What makes an error of an integral.
struct ErrorScale {
  double mean_reflected = 1;   // W/m2: the error is relative to it
  double reflecting_area = 0;  // m2, both of all sides that reflect
  UnseenError unseen;
};

// What a probe has measured.
struct ProbeResidual {
  double weight = 0;    // m2: the area that it stands for, times all probes
  double square = 0;    // r^2 without bias, mean of the channels, (W/m2)^2
  double enclosed = 0;  // share of its hemisphere that anything came from
  Rgb reflectance{};
};

class ResidualSum {
 public:
  explicit ResidualSum(const ErrorScale& scale) : scale_(scale) {}

  void Add(const ProbeResidual& probe);

  // Of all probes so far, after so many rays. `reflected`: the integral of
  // e^2 - r^2 by the same probes.
  [[nodiscard]] ResidualEstimate Estimate(const ErrorIntegral& reflected,
                                          uint64_t rays) const;

 private:
  [[nodiscard]] double CertainPart() const;
  [[nodiscard]] double UnseenPerSeen() const;

  ErrorScale scale_;
  OutlierSum squares_;  // weighted
  // Of the probes, m2: times the share of their hemispheres that is closed, and
  // times that again and the reflectance.
  double seen_area_ = 0;
  double reflected_area_ = 0;
};

// How many rays a decision takes at least.
struct DecidingRays {
  // To say that the error is smaller: what few points see of it may be nothing,
  // and then they are sure of that.
  uint64_t below = 0;
  // To say that it is larger, and on which patches.
  uint64_t above = 0;
};

// The interval is clear of an error, or narrow: more probes would change
// nothing.
bool IsDecided(const ResidualEstimate& estimate,
               double decide_at,
               DecidingRays least);

}  // namespace enfilade
