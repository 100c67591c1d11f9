#include "visibility/audit_rays.h"

#include "base/directions.h"
#include "base/random.h"
#include "base/stop.h"
#include "partition/patch_points.h"

#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

namespace enfilade {
namespace {

// Rays start this far from the edges of their patch, so that the rays shifted
// beside them start on the patch too.
constexpr double kEdgeMetres = 5e-4;
constexpr double kShiftMetres = 1e-4;

constexpr uint64_t kKey = 0x61756469742d3031;  // seeds the audit's rays

// Maps a point of [0,1]^2 into the patch, away from the patch's edges.
Point3 PointOffEdges(const Patch& p, double s, double t) {
  std::tie(s, t) = FoldedOnto(p.shape, s, t);
  if (p.shape == PatchShape::kTriangle) {
    // Moves the point towards the centroid, away from all three edges.
    const double height =
        2 * PatchArea(p) /
        std::max({Length(p.u), Length(p.v), Length(p.u - p.v)});
    const double pull = std::min(0.5, 3 * kEdgeMetres / height);
    s += pull * (1.0 / 3 - s);
    t += pull * (1.0 / 3 - t);
  } else {
    const double area = PatchArea(p);
    const double margin_s = std::min(0.4, kEdgeMetres * Length(p.v) / area);
    const double margin_t = std::min(0.4, kEdgeMetres * Length(p.u) / area);
    s = margin_s + (1 - 2 * margin_s) * s;
    t = margin_t + (1 - 2 * margin_t) * t;
  }
  return PointOn(p, s, t);
}

// A unit vector whose angle to the unit normal n has this cosine; `turn` in
// [0,1] turns the vector around n.
Vec3 DirectionAbout(Vec3 n, double cosine, double turn) {
  const double sine = std::sqrt(std::max(0.0, 1 - cosine * cosine));
  return AxesAbout(n).Direction(cosine, sine, 2 * kPi * turn);
}

}  // namespace

std::vector<CellShare> ShareRays(const BlockStorage& store, uint64_t rays) {
  std::vector<CellShare> shares;
  store.ForEachKey(BlockKind::kCellPatches, [&](const BlockKey& key) {
    shares.push_back({CellId(key.a)});
  });
  double total = 0;
  for (CellShare& share : shares) {
    ThrowIfStopRequested();
    const CellPatches content = LoadCellPatches(store, share.cell);
    share.bounds = content.bounds;
    for (const Patch& p : content.patches) {
      share.area_m2 += PatchArea(p);
    }
    total += share.area_m2;
  }
  std::erase_if(shares, [](const CellShare& s) { return s.area_m2 <= 0; });
  double sum = 0;
  uint64_t given = 0;
  for (size_t i = 0; i < shares.size(); ++i) {
    sum += 0.5 * shares[i].area_m2 / total +
           0.5 / static_cast<double>(shares.size());
    const bool is_last = i + 1 == shares.size();
    const auto until =
        is_last ? rays : static_cast<uint64_t>(sum * static_cast<double>(rays));
    shares[i].rays = until - std::min(until, given);
    given = std::max(given, until);
  }
  return shares;
}

AuditRays::AuditRays(CellId cell, const CellPatches& content)
    : cell_(cell), patches_(&content.patches) {
  double sum = 0;
  for (const Patch& p : *patches_) {
    sum += PatchArea(p);
    area_until_.push_back(sum);
  }
}

TraceRay AuditRays::Draw(uint64_t number) const {
  Random random(MixKey(MixKey(kKey, cell_.value), number));
  const double at = random.Next() * area_until_.back();
  const auto found =
      std::upper_bound(area_until_.begin(), area_until_.end() - 1, at);
  const Patch& p =
      (*patches_)[static_cast<size_t>(found - area_until_.begin())];
  const double s = random.Next();
  const double t = random.Next();
  const Vec3 n = PatchNormal(p);
  const double u = random.Next();
  const double cosine = number % 2 == 0 ? std::sqrt(u) : u;
  const Vec3 d = DirectionAbout(n, cosine, random.Next());
  return {PointOffEdges(p, s, t) + n * kRayOffsetMetres, d};
}

std::array<TraceRay, kRaysBeside> RaysBeside(const TraceRay& ray) {
  const Vec3 across = DirectionAbout(ray.direction, 0, 0) * kShiftMetres;
  const Vec3 along = Cross(ray.direction, across);
  const auto shifted = [&ray](Vec3 by) {
    return TraceRay{ray.origin + by, ray.direction};
  };
  return {shifted(across), shifted(-across), shifted(along), shifted(-along)};
}

}  // namespace enfilade
