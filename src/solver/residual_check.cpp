#include "solver/residual_check.h"

#include "base/error.h"
#include "base/parallel.h"
#include "base/random.h"
#include "partition/partition.h"
#include "solver/lamps.h"
#include "solver/reflected_error.h"
#include "solver/residual_probes.h"
#include "solver/solution.h"
#include "visibility/ray_tracer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <span>
#include <utility>
#include <vector>

namespace enfilade {
namespace {

// Keeps the samples apart from those of every other part of the program.
constexpr uint64_t kSeedDomain = 0x726573696475616cULL;
constexpr uint32_t kPointsPerRound = 3072;
// Of each of the two estimates at a point: strata of directions, lamps.
constexpr uint32_t kStrata = 8;
constexpr uint32_t kDirections = kStrata * kStrata;
constexpr uint32_t kLampSamples = 25;
constexpr uint32_t kSamples = kDirections + kLampSamples;
constexpr uint32_t kHalves = 2;
constexpr uint64_t kRaysPerPoint = uint64_t{kHalves} * kSamples;
// An interval of this half-width, relative, is narrow.
constexpr double kNarrow = 0.06;
constexpr double kDeviations = 1.96;
// Of solutions that are constant on their elements: error over what rays see of
// it, less 1, per share of the light that a bounce leaves:
// docs/decisions/residual-check.md.
constexpr double kSlopesPerBounce = 0.65;
// Of a ray, its hit, and what is looked up there.
constexpr uint64_t kRayBytes = sizeof(TraceRay) + sizeof(TraceHit) +
                               2 * sizeof(PatchPoint) + 2 * sizeof(Rgb) + 16;
constexpr uint64_t kMostBatchBytes = 24ULL << 20;
constexpr size_t kLeastBatchPoints = 8;

// cos_x cos_y / (pi r^2); 0 if the points are behind one another.
double GeometryTerm(Point3 x, Vec3 at_x, Point3 y, Vec3 at_y) {
  const Vec3 d = y - x;
  const double square = Dot(d, d);
  const double cosines = Dot(d, at_x) * -Dot(d, at_y);
  return Dot(d, at_x) > 0 && Dot(d, at_y) < 0 && square > 0
             ? cosines / (kPi * square * square)
             : 0;
}

// Sample k of the lamps: which one, and two coordinates on it. Evenly spread
// both over all lamps and on the only one there may be.
std::array<double, 3> LampSample(uint32_t k,
                                 const std::array<double, 3>& shift) {
  const double along = static_cast<double>(k) / kLampSamples + shift[0];
  return {along - std::floor(along),
          EvenlySpread(k, 1, shift[1]),
          EvenlySpread(k, 2, shift[2])};
}

Vec3 CosineDirection(const Patch& p, Vec3 normal, double s, double t) {
  const Vec3 u = Normalize(p.u);
  const Vec3 v = Cross(normal, u);
  const double r = std::sqrt(s);
  const double phi = 2 * kPi * t;
  return u * (r * std::cos(phi)) + v * (r * std::sin(phi)) +
         normal * std::sqrt(1 - s);
}

// A batch of probes and what they see.
struct Batch : ProbeBatch {
  explicit Batch(ProbeBatch chosen) : ProbeBatch(std::move(chosen)) {}

  std::vector<TraceRay> rays;  // [probe][half][sample]
  std::vector<TraceHit> hits;
  std::vector<Rgb> light;  // what a sample is worth, or would be if it is free
};

class ResidualMeter {
 public:
  ResidualMeter(const BlockStorage& store,
                const ResidualOptions& options,
                MemoryBudget& budget)
      : options_(options),
        partition_(LoadPartition(store)),
        solution_(store, budget),
        lamps_(store, solution_.Scene(), partition_.cells.size(), budget),
        reflected_(partition_.cells, budget),
        chooser_(store, partition_, solution_, options.mean_reflected, budget),
        batch_points_(BatchPoints(budget)),
        batch_charge_(budget,
                      batch_points_ * kRaysPerPoint * kRayBytes,
                      "rays of the residual") {
    {
      // The tracer takes half of what is free beside a cell's solution.
      const MemoryCharge room(
          budget, solution_.MostCellBytes(), "a cell's solution");
      tracer_.emplace(store, budget);
    }
  }

  ResidualEstimate Run() {
    ResidualEstimate estimate;
    if (chooser_.IsEmpty()) {
      return estimate;
    }
    uint64_t round = 0;
    do {
      AddRound(MixKey(MixKey(kSeedDomain, options_.seed), round++));
      estimate = Estimate();
    } while (!IsDecided(estimate) &&
             estimate.rays + kPointsPerRound * kRaysPerPoint <=
                 options_.most_rays);
    return estimate;
  }

 private:
  static size_t BatchPoints(const MemoryBudget& budget) {
    const uint64_t fit = std::min(budget.FreeBytes() / 4, kMostBatchBytes) /
                         (kRaysPerPoint * kRayBytes);
    return std::clamp<uint64_t>(fit, kLeastBatchPoints, kPointsPerRound);
  }

  void AddRound(uint64_t key) {
    for (uint32_t first = 0; first < kPointsPerRound;
         first += static_cast<uint32_t>(batch_points_)) {
      const uint32_t count = std::min<uint32_t>(
          kPointsPerRound - first, static_cast<uint32_t>(batch_points_));
      AddBatch(key, first, count);
    }
  }

  void AddBatch(uint64_t key, uint32_t first, uint32_t count) {
    if (options_.stop != nullptr && options_.stop->load()) {
      throw InterruptedError("stopped as asked; all work is kept");
    }
    Batch batch(chooser_.Choose(key, {first, count, kPointsPerRound}));
    const size_t all = batch.probes.size() * kRaysPerPoint;
    batch.rays.resize(all);
    batch.hits.resize(all);
    batch.light.resize(all);
    ParallelFor(batch.probes.size(), [&](size_t i) { MakeRays(i, &batch); });
    tracer_->Trace(batch.rays, batch.hits);
    rays_ += all;
    AddResiduals(batch, LookUp(&batch));
  }

  void MakeRays(size_t i, Batch* batch) const {
    const Probe& probe = batch->probes[i];
    const LampChoice lamps(
        lamps_, batch->visible[probe.visible], probe.origin, probe.normal);
    Random random(MixKey(probe.key, 1));
    for (uint32_t half = 0; half < kHalves; ++half) {
      const size_t first = i * kRaysPerPoint + size_t{half} * kSamples;
      for (uint32_t k = 0; k < kDirections; ++k) {
        const uint32_t row = k / kStrata;
        const uint32_t column = k % kStrata;
        const double s = (row + random.Next()) / kStrata;
        const double t = (column + random.Next()) / kStrata;
        batch->rays[first + k].origin = probe.origin;
        batch->rays[first + k].direction =
            CosineDirection(probe.patch, probe.normal, s, t);
      }
      const std::array<double, 3> shift = {
          random.Next(), random.Next(), random.Next()};
      for (uint32_t k = 0; k < kLampSamples; ++k) {
        AimAtLamp(probe,
                  lamps,
                  LampSample(k, shift),
                  &batch->rays[first + kDirections + k],
                  &batch->light[first + kDirections + k]);
      }
    }
  }

  // A ray to a point of a lamp, and the light that it brings if nothing is in
  // its way.
  void AimAtLamp(const Probe& probe,
                 const LampChoice& lamps,
                 const std::array<double, 3>& at,
                 TraceRay* ray,
                 Rgb* light) const {
    // What aims at nothing is worth nothing, wherever it goes.
    ray->origin = probe.origin;
    ray->direction = probe.normal;
    ray->max_distance = chooser_.Offset();
    if (lamps.IsEmpty()) {
      return;
    }
    const Lamp& lamp = lamps.Choose(at[0]);
    const auto [a, b] = UniformOn(lamp.patch, at[1], at[2]);
    const Point3 y = PointAt(lamp.patch, a, b);
    const double g = GeometryTerm(probe.origin, probe.normal, y, lamp.normal);
    if (g <= 0) {
      return;
    }
    ray->direction = y + lamp.normal * chooser_.Offset() - probe.origin;
    ray->max_distance = 1;
    AddScaled(light, lamp.exitance, WeightOf(g, lamps.Density(lamp)) * g);
  }

  // One over the density of all samples together, 1/m2.
  static double WeightOf(double geometry, double lamp_density) {
    return 1 / (kDirections * geometry + kLampSamples * lamp_density);
  }

  static void AddScaled(Rgb* sum, const Rgb& value, double factor) {
    for (size_t c = 0; c < kRgbChannels; ++c) {
      (*sum)[c] += factor * value[c];
    }
  }

  // Of the rays over the hemisphere: the solution's reflected light, and
  // emission as weighed. Returns the solution's radiosity at the probes, which
  // is read together with it: reading a cell costs far more than a point in it.
  std::vector<Rgb> LookUp(Batch* batch) const {
    std::vector<PatchPoint> points;
    for (const Probe& probe : batch->probes) {
      points.push_back(probe.on);
    }
    const size_t probes = points.size();
    std::vector<size_t> owners;
    for (size_t i = 0; i < batch->hits.size(); ++i) {
      const TraceHit& hit = batch->hits[i];
      if (i % kSamples < kDirections && hit.hit && hit.on_front) {
        points.push_back({hit.cell, hit.patch, hit.a, hit.b});
        owners.push_back(i);
      }
    }
    std::vector<Rgb> radiosity = solution_.Radiosity(points);
    ParallelFor(owners.size(), [&](size_t k) {
      const size_t i = owners[k];
      Rgb* light = &batch->light[i];
      AddScaled(light, radiosity[probes + k], 1.0 / kDirections);
      const TraceHit& hit = batch->hits[i];
      if (const Lamp* lamp = lamps_.Find(hit.cell, hit.patch)) {
        AddScaled(light, lamp->exitance, -1.0 / kDirections);
        const Probe& probe = batch->probes[i / kRaysPerPoint];
        const LampChoice lamps(
            lamps_, batch->visible[probe.visible], probe.origin, probe.normal);
        const TraceRay& ray = batch->rays[i];
        const double g = GeometryTerm(probe.origin,
                                      probe.normal,
                                      ray.origin + ray.direction * hit.distance,
                                      lamp->normal);
        AddScaled(light, lamp->exitance, WeightOf(g, lamps.Density(*lamp)) * g);
      }
    });
    radiosity.resize(probes);
    return radiosity;
  }

  // `solved`: the solution's radiosity at the probes.
  void AddResiduals(const Batch& batch, const std::vector<Rgb>& solved) {
    for (size_t i = 0; i < batch.probes.size(); ++i) {
      const Probe& probe = batch.probes[i];
      const Material& material =
          solution_.Scene().materials.at(probe.patch.material.Index());
      const Rgb& rho = material.reflectance;
      std::array<Rgb, kHalves> arriving{};
      for (size_t k = 0; k < kRaysPerPoint; ++k) {
        const size_t at = i * kRaysPerPoint + k;
        const bool is_blocked =
            k % kSamples >= kDirections && batch.hits[at].hit;
        AddScaled(&arriving[k / kSamples], batch.light[at], is_blocked ? 0 : 1);
      }
      ErrorProbe seen{GroupOf(probe), probe.weight, {}, rho};
      double square = 0;
      for (size_t c = 0; c < kRgbChannels; ++c) {
        const double reflected =
            solved[i][c] - (probe.patch.emits ? material.exitance[c] : 0.0);
        const double first = rho[c] * arriving[0][c] - reflected;
        const double second = rho[c] * arriving[1][c] - reflected;
        square += first * second / kRgbChannels;
        seen.residual[c] = (first + second) / 2;
      }
      reflected_.AddProbe(seen);
      const double enclosed = AddRays(batch, i, seen.group);
      seen_area_ += probe.weight * enclosed;
      reflected_area_ += probe.weight * enclosed * enclosed *
                         (rho[0] + rho[1] + rho[2]) / kRgbChannels;
      const double weighted = square * probe.weight;
      sum_ += weighted;
      squares_ += weighted * weighted;
      ++points_;
    }
  }

  [[nodiscard]] size_t GroupOf(const Probe& probe) const {
    return reflected_.GroupOf(probe.on.cell, probe.origin);
  }

  // Where the light of a probe came from; returns the share of its hemisphere
  // that anything came from.
  double AddRays(const Batch& batch, size_t probe, size_t group) {
    const double share =
        batch.probes[probe].weight / (double{kHalves} * kDirections);
    size_t hits = 0;
    for (size_t k = 0; k < kRaysPerPoint; ++k) {
      const size_t at = probe * kRaysPerPoint + k;
      const TraceHit& hit = batch.hits[at];
      if (k % kSamples < kDirections && hit.hit && hit.on_front) {
        ++hits;
        const TraceRay& ray = batch.rays[at];
        const Point3 y = ray.origin + ray.direction * hit.distance;
        reflected_.AddRay(group, reflected_.GroupOf(hit.cell, y), share);
      }
    }
    return static_cast<double>(hits) / (kHalves * kDirections);
  }

  [[nodiscard]] ResidualEstimate Estimate() const {
    const auto n = static_cast<double>(points_);
    const double local = sum_ / n;
    const ErrorIntegral reflected = reflected_.Integral();
    const double mean = local + reflected.value;
    const double deviation =
        std::hypot(std::sqrt(std::max(0.0, squares_ / n - local * local) / n),
                   reflected.deviation);
    const double slopes = options_.is_constant && seen_area_ > 0
                              ? kSlopesPerBounce * reflected_area_ / seen_area_
                              : 0;
    const auto relative = [&](double integral) {
      return (1 + slopes) *
             std::sqrt(std::max(0.0, integral) / chooser_.ReflectingArea()) /
             options_.mean_reflected;
    };
    return {relative(mean),
            relative(mean - kDeviations * deviation),
            relative(mean + kDeviations * deviation),
            mean > kDeviations * deviation ? relative(mean) : 0,
            relative(mean + deviation),
            points_,
            rays_};
  }

  [[nodiscard]] bool IsDecided(const ResidualEstimate& e) const {
    return e.low > options_.decide_at || e.high < options_.decide_at ||
           e.high - e.low < 2 * kNarrow * e.value;
  }

  ResidualOptions options_;
  Partition partition_;
  Solution solution_;
  Lamps lamps_;
  ReflectedError reflected_;
  ProbeChooser chooser_;
  std::optional<RayTracer> tracer_;
  size_t batch_points_;
  MemoryCharge batch_charge_;
  double sum_ = 0;
  double squares_ = 0;
  // Of the probes, m2: times the share of their hemispheres that is closed, and
  // times that again and the reflectance.
  double seen_area_ = 0;
  double reflected_area_ = 0;
  uint64_t points_ = 0;
  uint64_t rays_ = 0;
};

}  // namespace

ResidualEstimate MeasureResidual(const BlockStorage& store,
                                 const ResidualOptions& options,
                                 MemoryBudget& budget) {
  return ResidualMeter(store, options, budget).Run();
}

}  // namespace enfilade
