#include "tools/verify/density.h"

#include "base/check.h"
#include "base/random.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace enfilade {
namespace {

constexpr double kUniformShare = 0.15;
// The part of the non-uniform density that depends on the light alone. A pilot
// that met few of the brightest places knows too little of their noise.
constexpr double kLightShare = 0.4;
constexpr double kPriorPoints = 8;  // points that a class borrows from all
constexpr uint32_t kLeastStrata = 4;
constexpr uint32_t kMostStrata = 128;
// LimitPaths first reduces the classes with more strata than this.
constexpr uint32_t kManyStrata = 32;
constexpr double kPointWork = 16;  // work of a point itself, in paths
// At least this part of y^2 is taken not to be noise, because a pilot tells its
// noise only roughly.
constexpr double kLeastBetween = 1.0 / 64;

uint32_t StrataOf(double paths) {
  return static_cast<uint32_t>(std::clamp(
      std::ceil(std::sqrt(paths)), kLeastStrata * 1.0, kMostStrata * 1.0));
}

}  // namespace

PointDensity::PointDensity(std::vector<LightBin> bins)
    : area_(bins.empty() ? 0 : bins.back().end), bins_(std::move(bins)) {
  ENFILADE_CHECK(area_ > 0, "no bins");
  for (const LightBin& bin : bins_) {
    mean_level_ += bin.level * (bin.end - bin.begin) / area_;
  }
  strata_.fill(kLeastStrata);
  SetMasses([](const LightBin& bin) { return std::sqrt(bin.level); });
}

template <typename Density>
void PointDensity::SetMasses(const Density& density) {
  masses_.clear();
  double sum = 0;
  double light = 0;
  for (const LightBin& bin : bins_) {
    masses_.push_back(density(bin) * (bin.end - bin.begin));
    sum += masses_.back();
    light += std::sqrt(bin.level) * (bin.end - bin.begin);
  }
  for (size_t i = 0; i < bins_.size(); ++i) {
    const double length = bins_[i].end - bins_[i].begin;
    const double uniform = length / area_;
    const double learned = sum > 0 ? masses_[i] / sum : uniform;
    const double by_light =
        light > 0 ? std::sqrt(bins_[i].level) * length / light : uniform;
    masses_[i] = kUniformShare * uniform +
                 (1 - kUniformShare) *
                     (kLightShare * by_light + (1 - kLightShare) * learned);
  }
  class_masses_ = {};
  for (size_t i = 0; i < bins_.size(); ++i) {
    class_masses_[ClassOf(bins_[i].level)] += masses_[i];
  }
}

PointDensity::Draw PointDensity::Choose(uint32_t count, uint64_t key) const {
  Draw draw;
  size_t at = 0;
  double before = 0;  // probability of the bins before this one
  for (uint32_t i = 0; i < count; ++i) {
    Random random(MixKey(key, i));
    const double target = (i + random.Next()) / count;
    while (at + 1 < masses_.size() && target >= before + masses_[at]) {
      before += masses_[at++];
    }
    const double within =
        std::min((target - before) / masses_[at], 0x1.fffffffffffffp-1);
    const LightBin& bin = bins_[at];
    const double length = bin.end - bin.begin;
    draw.places.push_back(bin.begin + within * length);
    draw.weights.push_back(length / area_ / masses_[at]);
    draw.strata.push_back(strata_[ClassOf(bin.level)]);
  }
  return draw;
}

size_t PointDensity::BinAt(double place) const {
  const auto after = std::upper_bound(
      bins_.begin(), bins_.end(), place, [](double p, const LightBin& bin) {
        return p < bin.begin;
      });
  return static_cast<size_t>(
             std::max(after - bins_.begin(), std::ptrdiff_t{1})) -
         1;
}

size_t PointDensity::ClassOf(double level) const {
  if (!(level > 0)) {
    return 0;
  }
  const double octaves = std::floor(std::log2(level / mean_level_));
  return static_cast<size_t>(
      std::clamp(octaves + kClasses / 2.0, 0.0, kClasses - 1.0));
}

// The noise part of y^2 is the square of a variance, and each variance is
// guessed from two numbers. The sum over all points takes a third of the guess
// squared (unbiased for Gaussian noise), which is too large where strong paths
// are rare. The sum of a class takes the product with the guess at the class's
// previous point, which is too small where places differ, so that at least the
// resulting number of paths is needed.
void PointDensity::TakeIn(const Draw& draw,
                          std::span<const PilotValue> values) {
  ByClass<double> before{};
  for (size_t i = 0; i < values.size(); ++i) {
    const size_t k = ClassOf(bins_[BinAt(draw.places[i])].level);
    const double variance = values[i].noise;
    const double square = values[i].product * values[i].product;
    const double paths = static_cast<double>(draw.strata[i]) * draw.strata[i];
    const auto sums = [&](double noise) {
      return Sums{square, noise, noise * paths * paths, 1};
    };
    seen_[k].Add(sums(variance * before[k]), 1);
    weighted_.Add(sums(variance * variance / 3),
                  draw.weights[i] * draw.weights[i]);
    before[k] = variance;
    squares_ += square * draw.weights[i];
  }
  points_ += static_cast<double>(values.size());
}

double PointDensity::Sums::Between() const {
  return std::max(squares - noise, kLeastBetween * squares);
}

double PointDensity::Sums::BestPaths() const {
  return Between() > 0 ? std::sqrt(of_path / Between()) : 0;
}

void PointDensity::Learn(const Draw& draw, std::span<const PilotValue> values) {
  TakeIn(draw, values);
  ByClass<double> roots{};
  for (size_t k = 0; k < kClasses; ++k) {
    // Each class shares the sums of its neighbours, because outliers are rare
    // and strong.
    Sums all;
    for (size_t j = k > 0 ? k - 1 : 0; j < std::min(k + 2, kClasses); ++j) {
      all.Add(seen_[j], j == k ? 1 : 0.5);
    }
    // The number from all points is a lower limit, because a class that few
    // points met does not know all of its noise.
    strata_[k] = StrataOf(std::max(all.BestPaths(), weighted_.BestPaths()));
    const double paths = static_cast<double>(strata_[k]) * strata_[k];
    const double square = (kPriorPoints * squares_ / points_ + all.Between() +
                           all.of_path / (paths * paths)) /
                          (kPriorPoints + all.count);
    roots[k] = std::sqrt(square / (kPointWork + paths));
  }
  SetMasses([&](const LightBin& bin) { return roots[ClassOf(bin.level)]; });
}

double PointDensity::MeanPaths() const {
  double mean = 0;
  for (size_t k = 0; k < kClasses; ++k) {
    mean += class_masses_[k] * strata_[k] * strata_[k];
  }
  return mean;
}

void PointDensity::LimitPaths(double most) {
  for (const uint32_t least : {kManyStrata, kLeastStrata}) {
    const auto may_fall = [&](uint32_t strata) { return strata > least; };
    while (MeanPaths() > most &&
           std::any_of(strata_.begin(), strata_.end(), may_fall)) {
      for (uint32_t& strata : strata_) {
        strata = may_fall(strata) ? std::max(strata * 9 / 10, least) : strata;
      }
    }
  }
}

}  // namespace enfilade
