#include "scene/space_shell.h"

#include "base/directions.h"
#include "base/planar_polygon.h"
#include "base/random.h"
#include "base/stop.h"

#include <algorithm>
#include <cmath>

namespace enfilade {
namespace {

constexpr size_t kRays = 15;  // odd, for a majority
constexpr uint64_t kRayKey = 0x5ce11;

bool Encloses(const Polygon2& outline, Point2 p) {
  bool inside = false;
  for (size_t i = 0, j = outline.size() - 1; i < outline.size(); j = i++) {
    const Point2 a = outline[i];
    const Point2 b = outline[j];
    if ((a.y > p.y) != (b.y > p.y) &&
        p.x < a.x + (b.x - a.x) * ((p.y - a.y) / (b.y - a.y))) {
      inside = !inside;
    }
  }
  return inside;
}

// The projection of p onto the line a b, as a fraction of the way from a to b.
double FractionOnLine(Point3 p, Point3 a, Point3 b) {
  const Vec3 d = b - a;
  return Dot(p - a, d) / Dot(d, d);
}

}  // namespace

void SpaceShell::Add(std::span<const Point3> polygon) {
  Side side;
  side.frame =
      MakePlaneFrame(polygon[0], AreaVector(polygon), polygon[1] - polygon[0]);
  for (size_t i = 0; i < polygon.size(); ++i) {
    const Point3 p = polygon[i];
    side.outline.push_back(side.frame.To2(p));
    edges_.push_back({p, polygon[(i + 1) % polygon.size()]});
    bounds_.Include(p);
  }
  sides_.push_back(std::move(side));
}

size_t SpaceShell::Crossings(Point3 origin, Vec3 direction) const {
  size_t crossings = 0;
  for (const Side& side : sides_) {
    const double toward = Dot(direction, side.frame.normal);
    const double height = Dot(side.frame.origin - origin, side.frame.normal);
    if (toward == 0 || height / toward <= 0) {
      continue;
    }
    const Point3 hit = origin + direction * (height / toward);
    if (Encloses(side.outline, side.frame.To2(hit))) {
      ++crossings;
    }
  }
  return crossings;
}

bool SpaceShell::Contains(Point3 p) const {
  if (!bounds_.Contains(p)) {
    return false;
  }
  Random random(kRayKey);
  size_t odd = 0;
  for (size_t i = 0; i < kRays; ++i) {
    odd += Crossings(p, RandomDirection(random)) % 2;
  }
  return 2 * odd > kRays;
}

double SpaceShell::OpenLengthOf(const Edge& edge, double tolerance) const {
  constexpr double kParallel = 0.98;
  const double length = Length(edge.to - edge.from);
  const Vec3 along = (edge.to - edge.from) / length;
  std::vector<double> breaks{0, 1};
  std::vector<std::pair<double, double>> covers;
  for (const Edge& other : edges_) {
    const double other_length = Length(other.to - other.from);
    if (other_length <= tolerance ||
        std::abs(Dot(other.to - other.from, along)) <
            kParallel * other_length) {
      continue;
    }
    const double a = FractionOnLine(other.from, edge.from, edge.to);
    const double b = FractionOnLine(other.to, edge.from, edge.to);
    const auto [low, high] = std::minmax(a, b);
    if (high <= 0 || low >= 1) {
      continue;
    }
    // The distance from the edge to the other edge at a fraction of the edge.
    const auto off_at = [&](double at) {
      const double t = b == a ? 0 : (at - a) / (b - a);
      const Point3 p = Lerp(other.from, other.to, t);
      return Length(p - Lerp(edge.from, edge.to, at));
    };
    if (std::max(off_at(std::max(low, 0.0)), off_at(std::min(high, 1.0))) >
        tolerance) {
      continue;
    }
    covers.emplace_back(low, high);
    breaks.push_back(std::clamp(low, 0.0, 1.0));
    breaks.push_back(std::clamp(high, 0.0, 1.0));
  }
  std::sort(breaks.begin(), breaks.end());
  double open = 0;
  for (size_t i = 0; i + 1 < breaks.size(); ++i) {
    if ((breaks[i + 1] - breaks[i]) * length <= 2 * tolerance) {
      continue;
    }
    const double middle = 0.5 * (breaks[i] + breaks[i + 1]);
    const auto count =
        std::count_if(covers.begin(), covers.end(), [&](const auto& c) {
          return c.first < middle && middle < c.second;
        });
    if (count % 2 != 0) {
      open += (breaks[i + 1] - breaks[i]) * length;
    }
  }
  return open;
}

double SpaceShell::OpenLength(double tolerance) const {
  double open = 0;
  for (const Edge& edge : edges_) {
    ThrowIfStopRequested();
    if (Length(edge.to - edge.from) > 2 * tolerance) {
      open += OpenLengthOf(edge, tolerance);
    }
  }
  return open;
}

}  // namespace enfilade
