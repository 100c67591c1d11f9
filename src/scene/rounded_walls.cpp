#include "scene/rounded_walls.h"

#include "base/planar_polygon.h"
#include "scene/plane_snap.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include <Eigen/Dense>

namespace enfilade {
namespace {

// Planes of walls this much along each other do not determine a line.
constexpr double kLeastAcross = 0.3;
// Planes of walls with a greater cosine between them are parallel.
constexpr double kAlike = 0.999;
// A vertex moves at most this many steps, and at least this far.
constexpr double kMostSteps = 2;
constexpr double kLeastMoveM = 1e-10;
// The box around a wall is enlarged by this many steps.
constexpr double kBesideSteps = 10;

// Of each wall: its plane and box; directions, scatters and lists while planes
// are found.
constexpr uint64_t kBytesPerWall = 512;

double SumOfSizes(Vec3 v) {
  return std::abs(v.x) + std::abs(v.y) + std::abs(v.z);
}

// Rounding by half a step along each axis moves a point along a normal by up to
// half a step times the sum of the normal's sizes. Of oblique walls the planes
// are known only from rounded points, too: `unsure` steps off, more or less, if
// they are at 45 degrees.
double ToleranceM(double step_m, Vec3 normal, double unsure) {
  const double sizes = SumOfSizes(normal);
  return step_m * (0.5 * sizes + 2.4 * unsure * (sizes - 1));
}

// While each wall has its own direction, and when directions are known.
constexpr double kUnsureAtFirst = 0.4;
constexpr double kUnsure = 0.15;

// Directions with a greater cosine between them are one.
constexpr double kSameDirection = 1 - 1e-12;

// The scatter of the vertices of walls that face one way, each wall about its
// own middle.
using Scatter = Eigen::Matrix3d;

Scatter ScatterOf(const std::vector<Point3>& wall) {
  Vec3 sum;
  for (const Point3 p : wall) {
    sum = sum + (p - wall[0]);
  }
  const Point3 middle = wall[0] + sum / static_cast<double>(wall.size());
  Scatter scatter = Scatter::Zero();
  for (const Point3 p : wall) {
    const Vec3 d = p - middle;
    const Eigen::Vector3d off(d.x, d.y, d.z);
    scatter += off * off.transpose();
  }
  return scatter;
}

// A rotation about a coordinate axis by quarters of a turn.
Eigen::Matrix3d QuarterTurns(size_t axis, int quarters) {
  const size_t u = (axis + 1) % 3;
  const size_t v = (axis + 2) % 3;
  Eigen::Matrix3d quarter = Eigen::Matrix3d::Zero();
  const auto at = [](size_t i) { return static_cast<Eigen::Index>(i); };
  quarter(at(axis), at(axis)) = 1;
  quarter(at(v), at(u)) = 1;
  quarter(at(u), at(v)) = -1;
  Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
  for (int i = 0; i < quarters; ++i) {
    turn = quarter * turn;
  }
  return turn;
}

// A direction along which walls face. Walls of a level direction stand at right
// angles to others: these are one family, turned by quarters of a turn.
struct Facing {
  size_t axis = 3;   // that the direction is perpendicular to; 3: none
  int quarters = 0;  // that turn the direction into the family's first quadrant
  std::array<double, 3> family{};

  friend bool operator<(const Facing& a, const Facing& b) {
    return std::pair(a.axis, a.family) < std::pair(b.axis, b.family);
  }
};

Facing FacingOf(Vec3 direction) {
  for (const size_t axis : {size_t{2}, size_t{1}, size_t{0}}) {
    if (direction[axis] != 0) {
      continue;
    }
    Facing facing{axis, 0, {direction.x, direction.y, direction.z}};
    double& x = facing.family[(axis + 1) % 3];
    double& y = facing.family[(axis + 2) % 3];
    for (; !(x > 0 && y >= 0); ++facing.quarters) {
      x = std::exchange(y, x);
      x = -x;
    }
    return facing;
  }
  const bool flip = direction.x < 0;
  return {3,
          0,
          {flip ? -direction.x : direction.x,
           flip ? -direction.y : direction.y,
           flip ? -direction.z : direction.z}};
}

// The direction in which vertices scatter least; perpendicular to `axis`, if
// that is one.
Vec3 LeastScatter(Scatter scatter, size_t axis) {
  if (axis < 3) {
    const auto i = static_cast<Eigen::Index>(axis);
    const double most = scatter.trace();
    scatter.row(i).setZero();
    scatter.col(i).setZero();
    scatter(i, i) = 2 * most;
  }
  const Eigen::SelfAdjointEigenSolver<Scatter> solver(scatter);
  const Eigen::Vector3d least = solver.eigenvectors().col(0);
  std::array<double, 3> n = {least[0], least[1], least[2]};
  if (axis < 3) {
    n[axis] = 0;
  }
  return Normalize(Vec3{n[0], n[1], n[2]});
}

// The directions of oblique walls, each from all walls that face that way,
// those of the largest walls first.
std::vector<Vec3> FitDirections(std::span<const std::vector<Point3>> walls,
                                const SnappedPlanes& snapped) {
  std::map<Facing, size_t> place;
  std::vector<std::pair<Facing, Scatter>> found;
  std::vector<std::vector<uint32_t>> of_plane(snapped.planes.size());
  for (uint32_t i = 0; i < walls.size(); ++i) {
    of_plane[snapped.plane_of[i]].push_back(i);
  }
  for (size_t k = 0; k < snapped.planes.size(); ++k) {
    const Vec3 normal = snapped.planes[k].normal;
    if (RoundedWalls::IsAlongAxis(normal)) {
      continue;
    }
    const Facing facing = FacingOf(normal);
    const auto [entry, is_new] = place.try_emplace(facing, found.size());
    if (is_new) {
      found.emplace_back(facing, Scatter::Zero());
    }
    const Eigen::Matrix3d turn =
        facing.axis < 3 ? QuarterTurns(facing.axis, facing.quarters)
                        : Eigen::Matrix3d::Identity();
    for (const uint32_t i : of_plane[k]) {
      found[entry->second].second +=
          turn * ScatterOf(walls[i]) * turn.transpose();
    }
  }
  std::vector<Vec3> directions;
  for (const auto& [facing, scatter] : found) {
    directions.push_back(LeastScatter(scatter, facing.axis));
    if (facing.axis < 3) {
      std::array<double, 3> axis{};
      axis[facing.axis] = 1;
      directions.push_back(
          Cross(Vec3{axis[0], axis[1], axis[2]}, directions.back()));
    }
  }
  return directions;
}

// Moves the planes of oblique walls to the middle of their vertices.
void CenterOffsets(std::span<const std::vector<Point3>> walls,
                   SnappedPlanes* snapped) {
  struct Mean {
    double sum = 0;
    double count = 0;
  };

  std::vector<Mean> off(snapped->planes.size());
  for (size_t i = 0; i < walls.size(); ++i) {
    const Plane& plane = snapped->planes[snapped->plane_of[i]];
    Mean& mean = off[snapped->plane_of[i]];
    for (const Point3 p : walls[i]) {
      mean.sum += plane.Distance(p);
      mean.count += 1;
    }
  }
  for (size_t k = 0; k < off.size(); ++k) {
    if (off[k].count > 0 &&
        !RoundedWalls::IsAlongAxis(snapped->planes[k].normal)) {
      snapped->planes[k].offset += off[k].sum / off[k].count;
    }
  }
}

// Makes parallel planes of oblique walls one if they are nearer to each other
// than rounding can tell. What really stands before a wall does so by a step or
// more.
void MergeParallel(double step_m, SnappedPlanes* snapped) {
  constexpr double kMostApartSteps = 0.5;
  std::vector<uint32_t> merged(snapped->planes.size());
  for (uint32_t k = 0; k < merged.size(); ++k) {
    const Plane& plane = snapped->planes[k];
    merged[k] = k;
    for (uint32_t i = 0; i < k && !RoundedWalls::IsAlongAxis(plane.normal);
         ++i) {
      const Plane& other = snapped->planes[i];
      const double along = Dot(other.normal, plane.normal);
      const double offset = along > 0 ? plane.offset : -plane.offset;
      if (merged[i] == i && std::abs(along) > kSameDirection &&
          std::abs(offset - other.offset) <= kMostApartSteps * step_m) {
        merged[k] = i;
        break;
      }
    }
  }
  for (uint32_t& plane : snapped->plane_of) {
    plane = merged[plane];
  }
}

}  // namespace

RoundedWalls::RoundedWalls(std::span<const std::vector<Point3>> walls,
                           double step_m,
                           MemoryBudget& budget)
    : charge_(
          budget, walls.size() * kBytesPerWall, "the planes of oblique walls"),
      step_m_(step_m) {
  const auto snap = [&](double unsure, std::span<const Vec3> directions) {
    const auto tolerance = [=](Vec3 n) {
      return ToleranceM(step_m, n, unsure);
    };
    return SnapPlanes(walls, {tolerance, tolerance}, directions);
  };
  SnappedPlanes snapped =
      snap(kUnsure, FitDirections(walls, snap(kUnsureAtFirst, {})));
  CenterOffsets(walls, &snapped);
  MergeParallel(step_m, &snapped);
  CenterOffsets(walls, &snapped);
  planes_ = std::move(snapped.planes);
  plane_of_ = std::move(snapped.plane_of);
  std::vector<Box3> boxes;
  boxes.reserve(walls.size());
  for (const std::vector<Point3>& wall : walls) {
    boxes.push_back(Grown(BoundsOf(wall), kBesideSteps * step_m));
  }
  boxes_.emplace(std::move(boxes));
}

bool RoundedWalls::IsAlongAxis(Vec3 normal) {
  return std::max(
             {std::abs(normal.x), std::abs(normal.y), std::abs(normal.z)}) >
         kSameDirection;
}

Point3 RoundedWalls::Restored(Point3 p) const {
  std::vector<uint32_t> near;
  boxes_->ForOverlaps({p, p}, [&](uint32_t wall) {
    const Plane& plane = planes_[plane_of_[wall]];
    if (std::abs(plane.Distance(p)) <=
        ToleranceM(step_m_, plane.normal, kUnsure)) {
      near.push_back(plane_of_[wall]);
    }
  });
  std::sort(near.begin(), near.end());
  near.erase(std::unique(near.begin(), near.end()), near.end());
  // Of a wall and what lies before it, the nearer one.
  const auto hides = [&](uint32_t other, uint32_t one) {
    const Plane& a = planes_[other];
    const Plane& b = planes_[one];
    return std::abs(Dot(a.normal, b.normal)) > kAlike &&
           std::abs(a.Distance(p)) < std::abs(b.Distance(p));
  };
  // Each move is across the planes on which the point lies already.
  std::array<Vec3, 3> fixed;
  size_t count = 0;
  Point3 restored = p;
  for (const uint32_t i : near) {
    if (std::any_of(near.begin(), near.end(), [&](uint32_t other) {
          return hides(other, i);
        })) {
      continue;
    }
    const Plane& plane = planes_[i];
    Vec3 across = plane.normal;
    for (size_t k = 0; k < count; ++k) {
      across = across - fixed[k] * Dot(plane.normal, fixed[k]);
    }
    const double length = Length(across);
    if (length < kLeastAcross) {
      continue;
    }
    const Point3 moved = restored - across * (plane.Distance(restored) /
                                              Dot(across, plane.normal));
    if (Length(moved - p) > kMostSteps * step_m_) {
      continue;
    }
    restored = moved;
    fixed[count] = across / length;
    if (++count == fixed.size()) {
      break;
    }
  }
  return Length(restored - p) > kLeastMoveM ? restored : p;
}

}  // namespace enfilade
