#include "solver/residual_check.h"

#include "base/error.h"
#include "base/parallel.h"
#include "base/random.h"
#include "partition/partition.h"
#include "solver/lamps.h"
#include "solver/outlier_sum.h"
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
// Points of the first rounds; every four rounds twice as many, up to eight
// times.
constexpr uint32_t kPointsPerRound = 3072;
constexpr uint64_t kRoundsOfASize = 4;
constexpr uint64_t kMostDoublings = 3;
// Of each of the two estimates at a point: strata of directions, lamps.
constexpr uint32_t kStrata = 8;
constexpr uint32_t kDirections = kStrata * kStrata;
constexpr uint32_t kLampSamples = 25;
constexpr uint32_t kSamples = kDirections + kLampSamples;
constexpr uint32_t kHalves = 2;
constexpr uint64_t kRaysPerPoint = uint64_t{kHalves} * kSamples;
// An interval of this half-width, relative, is narrow.
constexpr double kNarrowInterval = 0.06;
constexpr double kDeviations = 1.96;
// More is asked for where points are left out, since the choice is free.
constexpr double kCertainDeviations = 3;
// Of solutions that are constant on their elements: error over what rays see of
// it, less 1, per share of the light that a bounce leaves:
// docs/decisions/residual-check.md.
constexpr double kSlopesPerBounce = 0.65;

// What a probe sees.
struct ProbeSight {
  // By half, W/m2: at first the light of the lamps that is sampled on them and
  // by rays, less what the solution's radiosity will bring of it again.
  std::array<Rgb, kHalves> arriving{};
  size_t group = 0;
  double enclosed = 0;  // share of the hemisphere that anything came from
};

// Of the rays of a point while they are traced, and of what is kept of them to
// be looked up.
constexpr uint64_t kTracedBytes =
    kRaysPerPoint * (sizeof(TraceRay) + sizeof(TraceHit) + sizeof(Rgb));
constexpr uint64_t kPointBytes =
    uint64_t{kHalves} * kDirections *
        (sizeof(PatchPoint) + sizeof(Rgb) + sizeof(size_t) + sizeof(uint32_t)) +
    sizeof(ResidualProbe) + ProbeChooser::kWorkBytesPerProbe +
    sizeof(ProbeSight);
constexpr uint64_t kMostBatchBytes = 48ULL << 20;
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

// A batch of probes, and where its rays met something. The probes themselves
// are the first points.
struct Batch : ProbeBatch {
  explicit Batch(ProbeBatch chosen) : ProbeBatch(std::move(chosen)) {}

  std::vector<ProbeSight> sights;
  std::vector<PatchPoint> points;
  std::vector<uint32_t> owners;  // of the points that are no probes: kHalves *
                                 // probe + half
};

// The rays of some probes of a batch.
struct RayPart {
  size_t first = 0;  // probe
  size_t count = 0;
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
        by_patch_(chooser_.FirstPatches(),
                  options.most_rays / kRaysPerPoint + kPointsPerRound,
                  budget),
        traced_points_(PointsIn(budget, kTracedBytes)),
        batch_points_(PointsIn(budget, kPointBytes)),
        batch_charge_(
            budget,
            traced_points_ * kTracedBytes + batch_points_ * kPointBytes,
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
    for (uint64_t round = 0;; ++round) {
      const auto points = static_cast<uint32_t>(
          kPointsPerRound << std::min(round / kRoundsOfASize, kMostDoublings));
      if (round > 0 && (IsDecided(estimate) ||
                        rays_ + points * kRaysPerPoint > options_.most_rays)) {
        return estimate;
      }
      AddRound(MixKey(MixKey(kSeedDomain, options_.seed), round), points);
      estimate = Estimate();
    }
  }

  PatchErrors TakePatchErrors() {
    by_patch_.Sort();
    return std::move(by_patch_);
  }

 private:
  // How many points of so many bytes fit in an eighth of what is free: one
  // eighth for those that are traced, one for those that are looked up.
  static size_t PointsIn(const MemoryBudget& budget, uint64_t bytes) {
    const uint64_t room = std::min(budget.FreeBytes() / 4, kMostBatchBytes) / 2;
    return std::clamp<uint64_t>(
        room / bytes, kLeastBatchPoints, kPointsPerRound << kMostDoublings);
  }

  void AddRound(uint64_t key, uint32_t points) {
    const auto most = static_cast<uint32_t>(batch_points_);
    for (uint32_t first = 0; first < points; first += most) {
      AddBatch(key, {first, std::min(points - first, most), points});
    }
  }

  void AddBatch(uint64_t key, const ProbeStrata& strata) {
    if (options_.stop != nullptr && options_.stop->load()) {
      throw InterruptedError("stopped as asked; all work is kept");
    }
    Batch batch(chooser_.Choose(key, strata));
    batch.sights.resize(batch.probes.size());
    const size_t most =
        batch.probes.size() * (1 + size_t{kHalves} * kDirections);
    batch.points.reserve(most);
    batch.owners.reserve(most);
    for (const ResidualProbe& probe : batch.probes) {
      batch.points.push_back(probe.on);
    }
    for (part_.first = 0; part_.first < batch.probes.size();
         part_.first += part_.count) {
      part_.count = std::min(traced_points_, batch.probes.size() - part_.first);
      Trace(batch, &part_);
      for (size_t i = part_.first; i < part_.first + part_.count; ++i) {
        AddSight(part_, i, &batch);
      }
    }
    AddResiduals(&batch);
  }

  void Trace(const Batch& batch, RayPart* part) {
    const size_t all = part->count * kRaysPerPoint;
    part->rays.assign(all, {});
    part->hits.assign(all, {});
    part->light.assign(all, {});
    ParallelFor(part->count, [&](size_t i) {
      MakeRays(batch, part->first + i, i * kRaysPerPoint, part);
    });
    tracer_->Trace(part->rays, part->hits);
    rays_ += all;
  }

  void MakeRays(const Batch& batch,
                size_t i,
                size_t first_ray,
                RayPart* part) const {
    const ResidualProbe& probe = batch.probes[i];
    const LampChoice lamps = LampsOf(batch, probe);
    Random random(MixKey(probe.key, 1));
    for (uint32_t half = 0; half < kHalves; ++half) {
      const size_t first = first_ray + size_t{half} * kSamples;
      for (uint32_t k = 0; k < kDirections; ++k) {
        const uint32_t row = k / kStrata;
        const uint32_t column = k % kStrata;
        const double s = (row + random.Next()) / kStrata;
        const double t = (column + random.Next()) / kStrata;
        part->rays[first + k].origin = probe.origin;
        part->rays[first + k].direction =
            CosineDirection(probe.patch, probe.normal, s, t);
      }
      const std::array<double, 3> shift = {
          random.Next(), random.Next(), random.Next()};
      for (uint32_t k = 0; k < kLampSamples; ++k) {
        AimAtLamp(probe,
                  lamps,
                  LampSample(k, shift),
                  &part->rays[first + kDirections + k],
                  &part->light[first + kDirections + k]);
      }
    }
  }

  // A ray to a point of a lamp, and the light that it brings if nothing is in
  // its way.
  void AimAtLamp(const ResidualProbe& probe,
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

  [[nodiscard]] LampChoice LampsOf(const Batch& batch,
                                   const ResidualProbe& probe) const {
    return {lamps_, batch.visible[probe.visible], probe.origin, probe.normal};
  }

  // Whether most rays over the hemisphere of a probe end within a distance.
  static bool IsNarrow(const RayPart& part, size_t i, double distance) {
    size_t near = 0;
    for (size_t k = 0; k < kRaysPerPoint; ++k) {
      const TraceHit& hit = part.hits[(i - part.first) * kRaysPerPoint + k];
      if (k % kSamples < kDirections && hit.hit && hit.distance < distance) {
        ++near;
      }
    }
    return 2 * near > size_t{kHalves} * kDirections;
  }

  // Takes from the rays of a probe what they say by themselves, and notes where
  // the solution is to be looked up.
  void AddSight(const RayPart& part, size_t i, Batch* batch) {
    const ResidualProbe& probe = batch->probes[i];
    ProbeSight& sight = batch->sights[i];
    const double near = reflected_.NarrowBelow(probe.on.cell);
    const bool is_narrow = IsNarrow(part, i, near);
    sight.group = reflected_.GroupOf(probe.on.cell, probe.origin, is_narrow);
    const double share = probe.weight / (double{kHalves} * kDirections);
    std::optional<LampChoice> lamps;
    size_t seen = 0;
    for (size_t k = 0; k < kRaysPerPoint; ++k) {
      const size_t at = (i - part.first) * kRaysPerPoint + k;
      const TraceHit& hit = part.hits[at];
      Rgb* arriving = &sight.arriving[k / kSamples];
      if (k % kSamples >= kDirections) {
        AddScaled(arriving, part.light[at], hit.hit ? 0 : 1);
        continue;
      }
      if (!hit.hit || !hit.on_front) {
        continue;
      }
      ++seen;
      const TraceRay& ray = part.rays[at];
      const Point3 y = ray.origin + ray.direction * hit.distance;
      // What is close to a point in a slot is in it too.
      reflected_.AddRay(
          sight.group,
          reflected_.GroupOf(hit.cell, y, is_narrow && hit.distance < near),
          share);
      batch->points.push_back({hit.cell, hit.patch, hit.a, hit.b});
      batch->owners.push_back(
          static_cast<uint32_t>(kHalves * i + k / kSamples));
      if (const Lamp* lamp = lamps_.Find(hit.cell, hit.patch)) {
        if (!lamps) {
          lamps.emplace(LampsOf(*batch, probe));
        }
        const double g =
            GeometryTerm(probe.origin, probe.normal, y, lamp->normal);
        AddScaled(arriving, lamp->exitance, -1.0 / kDirections);
        AddScaled(
            arriving, lamp->exitance, WeightOf(g, lamps->Density(*lamp)) * g);
      }
    }
    sight.enclosed = static_cast<double>(seen) / (kHalves * kDirections);
  }

  // Looks up the solution wherever rays have met it, and at the probes: in one
  // go, for reading a cell costs far more than a point in it.
  void AddResiduals(Batch* batch) {
    const std::vector<Rgb> radiosity = solution_.Radiosity(batch->points);
    const size_t probes = batch->probes.size();
    for (size_t k = 0; k < batch->owners.size(); ++k) {
      const uint32_t owner = batch->owners[k];
      AddScaled(&batch->sights[owner / kHalves].arriving[owner % kHalves],
                radiosity[probes + k],
                1.0 / kDirections);
    }
    for (size_t i = 0; i < probes; ++i) {
      AddResidual(batch->probes[i], batch->sights[i], radiosity[i]);
    }
  }

  // `solved`: the solution's radiosity at the probe.
  void AddResidual(const ResidualProbe& probe,
                   const ProbeSight& sight,
                   const Rgb& solved) {
    const Material& material =
        solution_.Scene().materials.at(probe.patch.material.Index());
    const Rgb& rho = material.reflectance;
    ErrorProbe seen{sight.group, probe.weight, {}, rho};
    double square = 0;
    for (size_t c = 0; c < kRgbChannels; ++c) {
      const double reflected =
          solved[c] - (probe.patch.emits ? material.exitance[c] : 0.0);
      const double first = rho[c] * sight.arriving[0][c] - reflected;
      const double second = rho[c] * sight.arriving[1][c] - reflected;
      square += first * second / kRgbChannels;
      seen.residual[c] = (first + second) / 2;
    }
    reflected_.AddProbe(seen);
    seen_area_ += probe.weight * sight.enclosed;
    reflected_area_ += probe.weight * sight.enclosed * sight.enclosed *
                       (rho[0] + rho[1] + rho[2]) / kRgbChannels;
    const double weighted = square * probe.weight;
    by_patch_.Add(probe.on.cell,
                  probe.on.patch,
                  chooser_.ShareOf(probe.on.cell, probe.on.patch),
                  weighted);
    sum_.Add(weighted);
  }

  [[nodiscard]] ResidualEstimate Estimate() const {
    const SampledMean local = sum_.MeanWithout(0);
    const ErrorIntegral reflected = reflected_.Integral();
    const double mean = local.value + reflected.value;
    const double deviation = std::hypot(local.deviation, reflected.deviation);
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
            relative(mean > kDeviations * deviation ? mean : CertainPart()),
            relative(mean + deviation),
            sum_.Count(),
            rays_};
  }

  // Where all points together leave open whether there is any error: that of
  // all but the few that leave it open.
  [[nodiscard]] double CertainPart() const {
    for (size_t k = 1; k <= OutlierSum::kMostOutliers; ++k) {
      const SampledMean others = sum_.MeanWithout(k);
      if (others.value > kCertainDeviations * others.deviation) {
        return others.value;
      }
    }
    return 0;
  }

  [[nodiscard]] bool IsDecided(const ResidualEstimate& e) const {
    if (e.low > options_.decide_at) {
      return rays_ >= options_.locating_rays;
    }
    return e.high < options_.decide_at ||
           e.high - e.low < 2 * kNarrowInterval * e.value;
  }

  ResidualOptions options_;
  Partition partition_;
  Solution solution_;
  Lamps lamps_;
  ReflectedError reflected_;
  ProbeChooser chooser_;
  PatchErrors by_patch_;
  std::optional<RayTracer> tracer_;
  size_t traced_points_;  // at a time
  size_t batch_points_;   // looked up at a time
  MemoryCharge batch_charge_;
  RayPart part_;    // kept from batch to batch: it is large
  OutlierSum sum_;  // of the squared residuals, weighted
  // Of the probes, m2: times the share of their hemispheres that is closed, and
  // times that again and the reflectance.
  double seen_area_ = 0;
  double reflected_area_ = 0;
  uint64_t rays_ = 0;
};

}  // namespace

ResidualEstimate MeasureResidual(const BlockStorage& store,
                                 const ResidualOptions& options,
                                 MemoryBudget& budget,
                                 PatchErrors* by_patch) {
  ResidualMeter meter(store, options, budget);
  const ResidualEstimate estimate = meter.Run();
  if (by_patch != nullptr) {
    *by_patch = meter.TakePatchErrors();
  }
  return estimate;
}

}  // namespace enfilade
