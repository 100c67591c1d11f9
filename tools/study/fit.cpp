#include "tools/study/fit.h"

#include <algorithm>
#include <cmath>

namespace enfilade {

std::optional<double> FitPower(
    std::span<const std::pair<double, double>> points) {
  double n = 0;
  double sum_x = 0;
  double sum_y = 0;
  double sum_xx = 0;
  double sum_xy = 0;
  for (const auto& [px, py] : points) {
    if (!(px > 0) || !(py > 0) || !std::isfinite(px) || !std::isfinite(py)) {
      return std::nullopt;
    }
    const double x = std::log(px);
    const double y = std::log(py);
    n += 1;
    sum_x += x;
    sum_y += y;
    sum_xx += x * x;
    sum_xy += x * y;
  }
  const double spread = n * sum_xx - sum_x * sum_x;
  if (n < 2 || spread <= 1e-12 * n * sum_xx) {
    return std::nullopt;
  }
  return (n * sum_xy - sum_x * sum_y) / spread;
}

std::optional<double> ErrorWithin(double budget,
                                  std::vector<std::pair<double, double>> runs) {
  std::erase_if(runs, [](const std::pair<double, double>& run) {
    return !(run.first > 0 && run.second > 0 && std::isfinite(run.second));
  });
  std::sort(runs.begin(), runs.end());
  std::optional<std::pair<double, double>> best;
  for (const auto& run : runs) {
    if (best && run.second >= best->second) {
      continue;
    }
    if (run.first > budget) {
      if (!best) {
        return std::nullopt;
      }
      const double along =
          std::log(budget / best->first) / std::log(run.first / best->first);
      return best->second * std::pow(run.second / best->second, along);
    }
    best = run;
  }
  return best ? std::optional(best->second) : std::nullopt;
}

}  // namespace enfilade
