// The rays of the residual's probes and the light that they bring: two
// estimates of the irradiance at each probe, by rays over its hemisphere and by
// rays to points of lamps, weighted by the balance heuristic (Veach & Guibas
// 1995).
//
// Each of the two halves of a probe x has n_d directions and n_l lamp points:
//
//   H(x)   irradiance, W/m2 per channel: E(x) + sum B(y) / n_d over what the
//          directions meet, less the emission of y, which is in E
//   E(x)   direct light, of both kinds of rays together
//   G      cos_x cos_y / (pi r^2), 1/m2: a direction's density on a lamp
//   p      density of the points of lamps, 1/m2
//   w      1 / (n_d G + n_l p), the weight of either kind
//
// residual_check looks B up in the solution later, for many probes at once,
// since reading a cell costs far more than evaluating a point in it.

#pragma once

#include "base/photometry.h"
#include "partition/patch.h"
#include "solver/residual/lamps.h"
#include "solver/residual/reflected_error.h"
#include "solver/residual/residual_probes.h"
#include "solver/solution/points_by_cell.h"
#include "solver/solution/solution.h"
#include "visibility/ray_tracer.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace enfilade {

// How many rays a probe has.
struct ResidualSamples {
  static constexpr uint32_t kHalves = 2;  // independent of each other
  static constexpr uint32_t kStrata = 8;  // of directions, along either axis
  static constexpr uint32_t kDirections = kStrata * kStrata;  // of a half
  static constexpr uint32_t kLamps = 25;                      // of a half
  static constexpr uint32_t kAll = kDirections + kLamps;
  static constexpr uint64_t kRaysPerProbe = uint64_t{kHalves} * kAll;

  // Whether this ray of a probe goes over the hemisphere, and not to a lamp.
  static constexpr bool IsDirection(size_t ray) {
    return ray % kAll < kDirections;
  }

  // The most points for each probe, beside itself, at which B is looked up.
  static constexpr uint64_t kPointsPerProbe = uint64_t{kHalves} * kDirections;
};

// What a probe sees.
struct ProbeSight {
  // Irradiance by half, W/m2. At first it is the direct light by both kinds of
  // rays, less the emission that the solution's radiosity will bring again.
  std::array<Rgb, ResidualSamples::kHalves> arriving{};
  Rgb solved{};         // the solution's radiosity at the probe, W/m2
  size_t group = 0;     // of the probe (reflected_error.h)
  double enclosed = 0;  // share of the hemisphere that surfaces fill
};

// What the probes of a batch see.
struct BatchSight {
  // A surface that a ray of a probe has met.
  struct MetSurface {
    uint32_t owner = 0;                    // kHalves * probe + half
    uint32_t group = 0;                    // of surface (reflected_error.h)
    std::optional<MaterialId> reflecting;  // once the point is looked up
  };

  // The bytes for each probe, those for looking up the solution included.
  static constexpr uint64_t kBytesPerProbe =
      (1 + ResidualSamples::kPointsPerProbe) *
          (sizeof(PatchPoint) + sizeof(MetSurface) +
           PointsByCell::kBytesPerPoint) +
      sizeof(ProbeSight);

  // Adds the solution's light at one of the points. The irradiance is complete
  // after all points; its bits depend on their order.
  void AddLight(size_t point, const LightAtPoint& light);

  std::vector<ProbeSight> probes;
  // Where the solution is to be looked up: at the probes, in their order, then
  // wherever their rays have met a front.
  std::vector<PatchPoint> points;
  std::vector<MetSurface> met;  // at the points that are no probes
};

class ResidualRays {
 public:
  // The bytes of a probe's rays while they are traced.
  static constexpr uint64_t kBytesPerProbe =
      ResidualSamples::kRaysPerProbe *
      (sizeof(TraceRay) + sizeof(TraceHit) + sizeof(Rgb) + sizeof(uint32_t));

  // Traces the rays of at most `most_traced` probes at a time, for which the
  // caller has charged the memory; the result has the same bits for any number.
  // `offset_m` is the distance of lamp points from their lamps. Lamps and
  // tracer must outlive this.
  ResidualRays(const Lamps& lamps,
               RayTracer& tracer,
               double offset_m,
               size_t most_traced)
      : lamps_(&lamps),
        tracer_(&tracer),
        offset_m_(offset_m),
        most_traced_(most_traced) {}

  // Finds what the probes see; `groups` says to which group of surface a point
  // belongs. All random numbers come from the keys of the probes.
  BatchSight Look(const ProbeBatch& batch, const ReflectedError& groups);

 private:
  // The rays of some probes of a batch.
  struct Part {
    [[nodiscard]] size_t FirstRayOf(size_t probe) const {
      return (probe - first) * ResidualSamples::kRaysPerProbe;
    }

    size_t first = 0;  // probe
    size_t count = 0;
    // All arrays are [probe][half][sample], directions first.
    std::vector<TraceRay> rays;
    std::vector<TraceHit> hits;
    std::vector<Rgb> light;        // of a lamp sample if nothing blocks it
    std::vector<uint32_t> groups;  // of the fronts that directions meet
  };

  void Trace(const ProbeBatch& batch);
  // `i`, here and below, is the index of a probe in the batch.
  void MakeRays(const ProbeBatch& batch, size_t i);
  void AimAtLamp(const ResidualProbe& probe,
                 const LampChoice& lamps,
                 const std::array<double, 3>& at,
                 size_t ray_index);
  ProbeSight SightOf(const ProbeBatch& batch,
                     size_t i,
                     const ReflectedError& groups);
  void NoteMet(size_t i, BatchSight* seen) const;
  [[nodiscard]] bool IsNarrow(size_t i, double distance) const;
  [[nodiscard]] LampChoice LampsOf(const ProbeBatch& batch,
                                   const ResidualProbe& probe) const;

  const Lamps* lamps_;
  RayTracer* tracer_;
  double offset_m_;
  size_t most_traced_;
  Part part_;  // kept from batch to batch: it is large
};

}  // namespace enfilade
