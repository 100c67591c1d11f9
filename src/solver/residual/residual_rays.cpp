#include "solver/residual/residual_rays.h"

#include "base/directions.h"
#include "base/parallel.h"
#include "base/photometry.h"
#include "base/random.h"
#include "base/stop.h"
#include "partition/patch_points.h"

#include <algorithm>
#include <cmath>
#include <optional>

namespace enfilade {
namespace {

using Samples = ResidualSamples;

// cos_x cos_y / (pi r^2), 1/m2; 0 if one of the points is behind the other.
double GeometryTerm(Point3 x, Vec3 normal_x, Point3 y, Vec3 normal_y) {
  const Vec3 d = y - x;
  const double r2 = Dot(d, d);
  const double cos_x = Dot(normal_x, d);
  const double cos_y = -Dot(normal_y, d);
  const bool face = cos_x > 0 && cos_y > 0 && r2 > 0;
  return face ? cos_x * cos_y / (kPi * r2 * r2) : 0;
}

// One over the density (1/m2) of all samples together.
double WeightOf(double geometry, double lamp_density) {
  return 1 / (Samples::kDirections * geometry + Samples::kLamps * lamp_density);
}

// Sample k of the lamps: a number that chooses the lamp, and two coordinates on
// it. The samples are spread evenly over all lamps and also over each, which
// matters if there is only one.
std::array<double, 3> LampSample(uint32_t k,
                                 const std::array<double, 3>& shift) {
  const double along = static_cast<double>(k) / Samples::kLamps + shift[0];
  return {along - std::floor(along),
          EvenlySpread(k, 1, shift[1]),
          EvenlySpread(k, 2, shift[2])};
}

void AddScaled(Rgb* sum, const Rgb& value, double factor) {
  for (size_t c = 0; c < kRgbChannels; ++c) {
    (*sum)[c] += factor * value[c];
  }
}

bool MeetsFront(const TraceHit& hit) {
  return hit.hit && hit.on_front;
}

// A sight with the points of the probes alone, and with room for all points
// that their rays meet.
BatchSight NothingSeen(const ProbeBatch& batch) {
  BatchSight seen;
  const size_t probes = batch.probes.size();
  seen.probes.resize(probes);
  seen.points.reserve(probes * (1 + Samples::kPointsPerProbe));
  seen.met.reserve(probes * Samples::kPointsPerProbe);
  for (const ResidualProbe& probe : batch.probes) {
    seen.points.push_back(probe.on);
  }
  return seen;
}

}  // namespace

void BatchSight::AddLight(size_t point, const LightAtPoint& light) {
  if (point < probes.size()) {
    probes[point].solved = light.radiosity;
    return;
  }
  MetSurface& surface = met[point - probes.size()];
  surface.reflecting = light.reflecting;
  AddScaled(&probes[surface.owner / Samples::kHalves]
                 .arriving[surface.owner % Samples::kHalves],
            light.radiosity,
            1.0 / Samples::kDirections);
}

BatchSight ResidualRays::Look(const ProbeBatch& batch,
                              const ReflectedError& groups) {
  BatchSight seen = NothingSeen(batch);
  const size_t probes = batch.probes.size();
  for (part_.first = 0; part_.first < probes; part_.first += part_.count) {
    ThrowIfStopRequested();
    part_.count = std::min(most_traced_, probes - part_.first);
    Trace(batch);
    ParallelFor(part_.count, [&](size_t k) {
      const size_t i = part_.first + k;
      seen.probes[i] = SightOf(batch, i, groups);
    });
    for (size_t i = part_.first; i < part_.first + part_.count; ++i) {
      NoteMet(i, &seen);
    }
  }
  return seen;
}

// Makes and traces the rays of the current part.
void ResidualRays::Trace(const ProbeBatch& batch) {
  const size_t all = part_.count * Samples::kRaysPerProbe;
  part_.rays.resize(all);
  part_.hits.resize(all);
  part_.light.resize(all);
  part_.groups.resize(all);
  ParallelFor(part_.count, [&](size_t i) { MakeRays(batch, part_.first + i); });
  tracer_->Trace(part_.rays, part_.hits);
}

void ResidualRays::MakeRays(const ProbeBatch& batch, size_t i) {
  const ResidualProbe& probe = batch.probes[i];
  const LampChoice lamps = LampsOf(batch, probe);
  const NormalAxes axes = AxesAbout(probe.normal, probe.patch.u);
  Random random(MixKey(probe.key, 1));
  for (uint32_t half = 0; half < Samples::kHalves; ++half) {
    const size_t first = part_.FirstRayOf(i) + size_t{half} * Samples::kAll;
    for (uint32_t k = 0; k < Samples::kDirections; ++k) {
      const uint32_t row = k / Samples::kStrata;
      const uint32_t column = k % Samples::kStrata;
      const double s = (row + random.Next()) / Samples::kStrata;
      const double t = (column + random.Next()) / Samples::kStrata;
      part_.rays[first + k] = {probe.origin, axes.CosineDirection(s, t)};
    }
    const std::array<double, 3> shift = {
        random.Next(), random.Next(), random.Next()};
    for (uint32_t k = 0; k < Samples::kLamps; ++k) {
      AimAtLamp(
          probe, lamps, LampSample(k, shift), first + Samples::kDirections + k);
    }
  }
}

// Makes a ray to a point of a lamp, and sets the light that the ray brings if
// nothing blocks it.
void ResidualRays::AimAtLamp(const ResidualProbe& probe,
                             const LampChoice& lamps,
                             const std::array<double, 3>& at,
                             size_t ray_index) {
  TraceRay& ray = part_.rays[ray_index];
  // A ray that aims at no lamp brings no light, whatever it meets.
  ray = {probe.origin, probe.normal, offset_m_};
  part_.light[ray_index] = {};
  if (lamps.IsEmpty()) {
    return;
  }
  const Lamp& lamp = lamps.Choose(at[0]);
  const auto [a, b] = FoldedOnto(lamp.patch.shape, at[1], at[2]);
  const Point3 y = PointOn(lamp.patch, a, b);
  const double g = GeometryTerm(probe.origin, probe.normal, y, lamp.normal);
  if (g <= 0) {
    return;
  }
  ray.direction = y + lamp.normal * offset_m_ - probe.origin;
  ray.max_distance = 1;
  AddScaled(&part_.light[ray_index],
            lamp.exitance,
            WeightOf(g, lamps.Density(lamp)) * g);
}

LampChoice ResidualRays::LampsOf(const ProbeBatch& batch,
                                 const ResidualProbe& probe) const {
  return {*lamps_, batch.visible[probe.visible], probe.origin, probe.normal};
}

// Whether most rays over the hemisphere of a probe end within a distance.
bool ResidualRays::IsNarrow(size_t i, double distance) const {
  size_t near = 0;
  for (size_t k = 0; k < Samples::kRaysPerProbe; ++k) {
    const TraceHit& hit = part_.hits[part_.FirstRayOf(i) + k];
    if (Samples::IsDirection(k) && hit.hit && hit.distance < distance) {
      ++near;
    }
  }
  return 2 * near > Samples::kPointsPerProbe;
}

// What the rays of a probe tell without the solution's radiosity. Also finds
// the groups of surface that they meet.
ProbeSight ResidualRays::SightOf(const ProbeBatch& batch,
                                 size_t i,
                                 const ReflectedError& groups) {
  const ResidualProbe& probe = batch.probes[i];
  ProbeSight sight;
  const double near = groups.NarrowBelow(probe.on.cell);
  const bool is_narrow = IsNarrow(i, near);
  sight.group = groups.GroupOf(probe.on.cell, probe.origin, is_narrow);
  std::optional<LampChoice> lamps;
  size_t met = 0;
  for (size_t k = 0; k < Samples::kRaysPerProbe; ++k) {
    const size_t at = part_.FirstRayOf(i) + k;
    const TraceHit& hit = part_.hits[at];
    Rgb* arriving = &sight.arriving[k / Samples::kAll];
    if (!Samples::IsDirection(k)) {
      AddScaled(arriving, part_.light[at], hit.hit ? 0 : 1);
      continue;
    }
    if (!MeetsFront(hit)) {
      continue;
    }
    ++met;
    const TraceRay& ray = part_.rays[at];
    const Point3 y = ray.origin + ray.direction * hit.distance;
    // A point close to a probe in a narrow slot is in the slot, too.
    part_.groups[at] = static_cast<uint32_t>(
        groups.GroupOf(hit.cell, y, is_narrow && hit.distance < near));
    if (const Lamp* lamp = lamps_->Find(hit.cell, hit.patch)) {
      if (!lamps) {
        lamps.emplace(LampsOf(batch, probe));
      }
      const double g =
          GeometryTerm(probe.origin, probe.normal, y, lamp->normal);
      AddScaled(arriving, lamp->exitance, -1.0 / Samples::kDirections);
      // Rounding may put a probe in the plane of a lamp that its ray meets.
      if (g > 0) {
        AddScaled(
            arriving, lamp->exitance, WeightOf(g, lamps->Density(*lamp)) * g);
      }
    }
  }
  sight.enclosed =
      static_cast<double>(met) / (Samples::kHalves * Samples::kDirections);
  return sight;
}

// Notes where the solution is to be looked up.
void ResidualRays::NoteMet(size_t i, BatchSight* seen) const {
  for (size_t k = 0; k < Samples::kRaysPerProbe; ++k) {
    const size_t at = part_.FirstRayOf(i) + k;
    const TraceHit& hit = part_.hits[at];
    if (Samples::IsDirection(k) && MeetsFront(hit)) {
      seen->points.push_back({hit.cell, hit.patch, hit.a, hit.b});
      seen->met.push_back(
          {static_cast<uint32_t>(Samples::kHalves * i + k / Samples::kAll),
           part_.groups[at],
           {}});
    }
  }
}

}  // namespace enfilade
