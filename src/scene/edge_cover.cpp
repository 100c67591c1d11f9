#include "scene/edge_cover.h"

#include "base/vec.h"

#include <algorithm>
#include <cmath>

namespace enfilade {
namespace {

// The projection of p onto the line a b, as a fraction of the way from a to b.
double FractionOnLine(Point3 p, Point3 a, Point3 b) {
  const Vec3 d = b - a;
  return Dot(p - a, d) / Dot(d, d);
}

}  // namespace

std::optional<EdgeStretch> StretchBeside(const Edge3& edge,
                                         const Edge3& other,
                                         double tolerance) {
  constexpr double kParallel = 0.98;
  const Vec3 along = Normalize(edge.to - edge.from);
  const double other_length = Length(other.to - other.from);
  if (other_length <= tolerance ||
      std::abs(Dot(other.to - other.from, along)) < kParallel * other_length) {
    return std::nullopt;
  }
  const double a = FractionOnLine(other.from, edge.from, edge.to);
  const double b = FractionOnLine(other.to, edge.from, edge.to);
  const auto [low, high] = std::minmax(a, b);
  if (high <= 0 || low >= 1) {
    return std::nullopt;
  }
  // The distance from the edge to the other edge at a fraction of the edge.
  const auto off_at = [&](double at) {
    const double t = b == a ? 0 : (at - a) / (b - a);
    const Point3 p = Lerp(other.from, other.to, t);
    return Length(p - Lerp(edge.from, edge.to, at));
  };
  if (std::max(off_at(std::max(low, 0.0)), off_at(std::min(high, 1.0))) >
      tolerance) {
    return std::nullopt;
  }
  return EdgeStretch{low, high};
}

double LengthOfOdd(double edge_length,
                   const std::vector<EdgeStretch>& stretches,
                   double tolerance) {
  std::vector<double> breaks{0, 1};
  for (const EdgeStretch& s : stretches) {
    breaks.push_back(std::clamp(s.low, 0.0, 1.0));
    breaks.push_back(std::clamp(s.high, 0.0, 1.0));
  }
  std::sort(breaks.begin(), breaks.end());
  double odd = 0;
  for (size_t i = 0; i + 1 < breaks.size(); ++i) {
    if ((breaks[i + 1] - breaks[i]) * edge_length <= 2 * tolerance) {
      continue;
    }
    const double middle = 0.5 * (breaks[i] + breaks[i + 1]);
    const auto count = std::count_if(
        stretches.begin(), stretches.end(), [&](const EdgeStretch& s) {
          return s.low < middle && middle < s.high;
        });
    if (count % 2 != 0) {
      odd += (breaks[i + 1] - breaks[i]) * edge_length;
    }
  }
  return odd;
}

}  // namespace enfilade
