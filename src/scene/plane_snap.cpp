#include "scene/plane_snap.h"

#include "base/planar_polygon.h"
#include "base/stop.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace enfilade {
namespace {

// A polygon is compared with a plane only if the cosine between their normals
// is at least this.
constexpr double kNearlyParallel = 0.9;

double GreatestDistance(const std::vector<Point3>& polygon,
                        const Plane& plane) {
  double greatest = 0;
  for (const Point3 p : polygon) {
    greatest = std::max(greatest, std::abs(plane.Distance(p)));
  }
  return greatest;
}

// The plane with that normal, midway between the outermost vertices.
Plane MiddlePlane(const std::vector<Point3>& polygon, Vec3 normal) {
  const AxisRange range = RangeAlong(polygon, normal);
  return {normal, 0.5 * (range.low + range.high)};
}

class PlaneSnapper {
 public:
  PlaneSnapper(const PlaneTolerance& tolerance,
               std::span<const Vec3> directions)
      : tolerance_(tolerance) {
    directions_.insert(directions_.end(), directions.begin(), directions.end());
  }

  uint32_t PlaneFor(const std::vector<Point3>& polygon) {
    const Vec3 normal = Normalize(AreaVector(polygon));
    if (const auto known = KnownPlane(polygon, normal); known != kNone) {
      return known;
    }
    planes_.push_back(NewPlane(polygon, normal));
    reach_.push_back(tolerance_.of_known(planes_.back().normal));
    return static_cast<uint32_t>(planes_.size() - 1);
  }

  std::vector<Plane> Take() { return std::move(planes_); }

 private:
  static constexpr uint32_t kNone = std::numeric_limits<uint32_t>::max();

  [[nodiscard]] uint32_t KnownPlane(const std::vector<Point3>& polygon,
                                    Vec3 normal) const {
    uint32_t best = kNone;
    double least = std::numeric_limits<double>::infinity();
    for (uint32_t i = 0; i < planes_.size(); ++i) {
      const Plane& plane = planes_[i];
      if (std::abs(plane.Distance(polygon[0])) > reach_[i] ||
          std::abs(Dot(plane.normal, normal)) < kNearlyParallel) {
        continue;
      }
      const double distance = GreatestDistance(polygon, plane);
      if (distance <= reach_[i] && distance < least) {
        best = i;
        least = distance;
      }
    }
    return best;
  }

  Plane NewPlane(const std::vector<Point3>& polygon, Vec3 normal) {
    for (const Vec3 direction : directions_) {
      if (std::abs(Dot(direction, normal)) < kNearlyParallel) {
        continue;
      }
      const Vec3 turned = Dot(direction, normal) > 0 ? direction : -direction;
      const Plane plane = MiddlePlane(polygon, turned);
      if (IsNear(polygon, plane)) {
        return plane;
      }
    }
    for (const Vec3 axis : {Vec3{0, 0, 1}, Vec3{0, 1, 0}, Vec3{1, 0, 0}}) {
      const Vec3 across = normal - axis * Dot(normal, axis);
      if (Length(across) <= kNearlyParallel) {
        continue;
      }
      const Plane along = MiddlePlane(polygon, Normalize(across));
      if (IsNear(polygon, along)) {
        directions_.push_back(along.normal);
        directions_.push_back(Cross(axis, along.normal));
        return along;
      }
    }
    directions_.push_back(normal);
    return MiddlePlane(polygon, normal);
  }

  // Whether a polygon may be turned into the plane.
  [[nodiscard]] bool IsNear(const std::vector<Point3>& polygon,
                            const Plane& plane) const {
    return GreatestDistance(polygon, plane) <=
           tolerance_.of_turned(plane.normal);
  }

  const PlaneTolerance& tolerance_;
  std::vector<Plane> planes_;
  std::vector<double> reach_;  // the tolerance of each
  std::vector<Vec3> directions_{{0, 0, 1}, {1, 0, 0}, {0, 1, 0}};
};

}  // namespace

SnappedPlanes SnapPlanes(std::span<const std::vector<Point3>> polygons,
                         const PlaneTolerance& tolerance,
                         std::span<const Vec3> directions) {
  std::vector<double> area(polygons.size());
  std::vector<uint32_t> order(polygons.size());
  std::iota(order.begin(), order.end(), 0U);
  for (const uint32_t i : order) {
    area[i] = PolygonArea(polygons[i]);
  }
  std::stable_sort(order.begin(), order.end(), [&](uint32_t a, uint32_t b) {
    return area[a] > area[b];
  });
  PlaneSnapper snapper(tolerance, directions);
  SnappedPlanes snapped;
  snapped.plane_of.resize(polygons.size());
  for (const uint32_t i : order) {
    ThrowIfStopRequested();
    snapped.plane_of[i] = snapper.PlaneFor(polygons[i]);
  }
  snapped.planes = snapper.Take();
  return snapped;
}

SnappedPlanes SnapPlanes(std::span<const std::vector<Point3>> polygons,
                         double tolerance_m) {
  return SnapPlanes(polygons,
                    {[=](Vec3 /*normal*/) { return tolerance_m; },
                     [=](Vec3 /*normal*/) { return 0.5 * tolerance_m; }});
}

}  // namespace enfilade
