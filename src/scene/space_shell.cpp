#include "scene/space_shell.h"

#include "base/directions.h"
#include "base/planar_polygon.h"
#include "base/random.h"
#include "base/stop.h"
#include "scene/edge_cover.h"

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

double SpaceShell::OpenLengthOf(const Edge3& edge, double tolerance) const {
  std::vector<EdgeStretch> stretches;
  for (const Edge3& other : edges_) {
    if (const auto stretch = StretchBeside(edge, other, tolerance)) {
      stretches.push_back(*stretch);
    }
  }
  return LengthOfOdd(Length(edge.to - edge.from), stretches, tolerance);
}

double SpaceShell::OpenLength(double tolerance) const {
  double open = 0;
  for (const Edge3& edge : edges_) {
    ThrowIfStopRequested();
    if (Length(edge.to - edge.from) > 2 * tolerance) {
      open += OpenLengthOf(edge, tolerance);
    }
  }
  return open;
}

}  // namespace enfilade
