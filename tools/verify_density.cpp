#include "tools/verify_density.h"

#include "base/check.h"
#include "base/random.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace enfilade {
namespace {

constexpr double kUniformShare = 0.15;
constexpr double kPriorPoints = 8;  // that a class borrows from all

}  // namespace

PointDensity::PointDensity(double area, std::vector<double> levels)
    : area_(area), levels_(std::move(levels)) {
  ENFILADE_CHECK(!levels_.empty(), "no bins");
  mean_level_ = std::accumulate(levels_.begin(), levels_.end(), 0.0) /
                static_cast<double>(levels_.size());
  std::vector<double> masses;
  for (const double level : levels_) {
    masses.push_back(std::sqrt(level));
  }
  SetMasses(std::move(masses));
}

// To probabilities, with the uniform share.
void PointDensity::SetMasses(std::vector<double> masses) {
  const double sum = std::accumulate(masses.begin(), masses.end(), 0.0);
  const double uniform = 1 / static_cast<double>(masses.size());
  for (double& mass : masses) {
    mass = sum > 0 ? kUniformShare * uniform + (1 - kUniformShare) * mass / sum
                   : uniform;
  }
  masses_ = std::move(masses);
}

PointDensity::Draw PointDensity::Choose(uint32_t count, uint64_t key) const {
  const auto bins = static_cast<double>(masses_.size());
  Draw draw;
  size_t bin = 0;
  double before = 0;  // probability of the bins before this one
  for (uint32_t i = 0; i < count; ++i) {
    Random random(MixKey(key, i));
    const double target = (i + random.Next()) / count;
    while (bin + 1 < masses_.size() && target >= before + masses_[bin]) {
      before += masses_[bin++];
    }
    const double within =
        std::min((target - before) / masses_[bin], 0x1.fffffffffffffp-1);
    draw.places.push_back((static_cast<double>(bin) + within) * area_ / bins);
    draw.weights.push_back(1 / (bins * masses_[bin]));
  }
  return draw;
}

size_t PointDensity::BinAt(double place) const {
  const auto bins = static_cast<double>(masses_.size());
  return std::min(static_cast<size_t>(place / area_ * bins),
                  masses_.size() - 1);
}

size_t PointDensity::ClassOf(double level) const {
  if (!(level > 0)) {
    return 0;
  }
  const double octaves = std::floor(std::log2(level / mean_level_));
  return static_cast<size_t>(
      std::clamp(octaves + kClasses / 2.0, 0.0, kClasses - 1.0));
}

void PointDensity::Learn(const Draw& draw, std::span<const double> values) {
  std::array<double, kClasses> squares{};
  std::array<double, kClasses> counts{};
  double all_squares = 0;
  for (size_t i = 0; i < values.size(); ++i) {
    const size_t k = ClassOf(levels_[BinAt(draw.places[i])]);
    squares[k] += values[i] * values[i];
    counts[k] += 1;
    all_squares += values[i] * values[i] * draw.weights[i];
  }
  all_squares /= static_cast<double>(values.size());
  // Classes share with their neighbours: outliers are rare and strong.
  std::array<double, kClasses> roots{};
  for (size_t k = 0; k < kClasses; ++k) {
    double sum = kPriorPoints * all_squares;
    double count = kPriorPoints;
    for (size_t j = k > 0 ? k - 1 : 0; j < std::min(k + 2, kClasses); ++j) {
      const double share = j == k ? 1 : 0.5;
      sum += share * squares[j];
      count += share * counts[j];
    }
    roots[k] = std::sqrt(sum / count);
  }
  std::vector<double> masses;
  for (const double level : levels_) {
    masses.push_back(roots[ClassOf(level)]);
  }
  SetMasses(std::move(masses));
}

}  // namespace enfilade
