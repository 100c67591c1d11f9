#include "solver/residual/residual_estimate.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace enfilade {
namespace {

// An interval of this half-width, relative, is narrow.
constexpr double kNarrowInterval = 0.06;
constexpr double kDeviations = 1.96;
// More is asked for where points are left out, since the choice is free.
constexpr double kCertainDeviations = 3;

}  // namespace

void ResidualSum::Add(const ProbeResidual& probe) {
  const Rgb& rho = probe.reflectance;
  seen_area_ += probe.weight * probe.enclosed;
  reflected_area_ += probe.weight * probe.enclosed * probe.enclosed *
                     (rho[0] + rho[1] + rho[2]) / kRgbChannels;
  squares_.Add(probe.square * probe.weight);
}

ResidualEstimate ResidualSum::Estimate(const ErrorIntegral& reflected,
                                       uint64_t rays) const {
  const SampledMean local = squares_.MeanWithout(0);
  const double mean = local.value + reflected.value;
  const double deviation = std::hypot(local.deviation, reflected.deviation);
  const double unseen = UnseenPerSeen();
  const double certain = mean > kDeviations * deviation ? mean : CertainPart();
  const auto relative = [&](double integral) {
    return (1 + unseen) *
           std::sqrt(std::max(0.0, integral) / scale_.reflecting_area) /
           scale_.mean_reflected;
  };
  return {relative(mean),
          relative(mean - kDeviations * deviation),
          relative(mean + kDeviations * deviation),
          relative(certain),
          // No less, where points that were left out, or what reflection adds,
          // are below zero: noise.
          relative(std::max(certain, std::max(mean, 0.0) + deviation)),
          squares_.Count(),
          rays};
}

// Where all points together leave open whether there is any error: that of all
// but the few that leave it open.
double ResidualSum::CertainPart() const {
  for (size_t k = 1; k <= OutlierSum::kMostOutliers; ++k) {
    const SampledMean others = squares_.MeanWithout(k);
    if (others.value > kCertainDeviations * others.deviation) {
      return others.value;
    }
  }
  return 0;
}

double ResidualSum::UnseenPerSeen() const {
  const double bounce = seen_area_ > 0 ? reflected_area_ / seen_area_ : 0;
  return scale_.unseen.always + scale_.unseen.per_bounce * bounce;
}

bool IsDecided(const ResidualEstimate& estimate,
               double decide_at,
               DecidingRays least) {
  if (estimate.low > decide_at) {
    return estimate.rays >= least.above;
  }
  return (estimate.high < decide_at && estimate.rays >= least.below) ||
         estimate.high - estimate.low < 2 * kNarrowInterval * estimate.value;
}

}  // namespace enfilade
