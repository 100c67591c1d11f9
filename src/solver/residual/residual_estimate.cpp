#include "solver/residual/residual_estimate.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace enfilade {
namespace {

// An interval is narrow if its half-width is below this share of the value.
constexpr double kNarrowInterval = 0.06;
constexpr double kDeviations = 1.96;
// More deviations are required if points are left out, since the choice of
// these points is free.
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
          // At least `certain`: noise may make the points that were left out,
          // or what reflection adds, negative.
          relative(std::max(certain, std::max(mean, 0.0) + deviation)),
          squares_.Count(),
          rays};
}

// If all points together leave open whether there is any error: the mean of r^2
// over all points but the few that leave it open, or 0 if the others leave it
// open, too.
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
