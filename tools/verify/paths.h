// Irradiance at points by Monte Carlo: unbiased path tracing, or one bounce of
// final gathering into a known field.
//
// Everything is in radiosity units: with directions in proportion to the
// cosine, the irradiance at x is the mean of the radiosity that its rays meet,
//
//   H(x) = E[ B(y) ],   B(y) = E_e(y) + rho(y) H(y).
//
// Emission is estimated by both the rays and sampled emitters, weighed by the
// balance heuristic (Veach & Guibas 1995) in the measure of area at y: the ray
// has density e G(x, y) = e cos_x cos_y / (pi r^2) and the emitter's sample
// P / A, so that either contributes E_e G / (e G + P / A). The excess e is 1,
// and the contribution at most E_e, where no guide (guide.h) leads
// elsewhere than the cosine. Paths end by Russian roulette on the reflectance.

#pragma once

#include "base/memory.h"
#include "base/random.h"

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "tools/building_surfaces.h"
#include "tools/building_view.h"
#include "tools/verify/geometry.h"
#include "tools/verify/guide.h"
#include "tools/verify/lights.h"
#include "tools/verify/seen.h"

namespace enfilade {

enum class GatherMode {
  kPaths,  // follows light through all its reflections
  kField,  // takes the view's radiosity for reflected light at the first hit
};

// How much a batch of paths takes of what is free. Where the building does not
// fit, every batch reads it again.
enum class BatchRoom {
  kShare,  // a sixth: other things follow
  kMost,   // three quarters, beside the patches of any one cell
};

class PathTracer {
 public:
  // Takes a share of what is free in the budget for surfaces and a batch of
  // paths, and for emitters at most `emitter_bytes`. The view must outlive
  // this.
  PathTracer(const BuildingView& view,
             MemoryBudget& budget,
             uint64_t emitter_bytes,
             BatchRoom room = BatchRoom::kShare);
  PathTracer(const BuildingView& view,
             MemoryBudget& budget,
             BatchRoom room = BatchRoom::kShare);

  // Finds by rays which emitters the cells see, for receivers that know their
  // cell and for all later vertices; worth its time before many paths. Takes
  // up to half of what is free in the budget.
  void LearnEmitters(MemoryBudget& budget, uint64_t key);

  // Lets paths go to where the field reflects much light; as
  // `PathGuide::Learn`. Takes up to an eighth of what is free in the budget.
  void LearnBrightParts(std::vector<BrightPart> parts,
                        double mean_radiosity,
                        MemoryBudget& budget,
                        uint64_t key);

  // For every receiver the mean over strata^2 paths, stratified in the first
  // direction; `strata` for each of them. A pure function of the arguments and
  // the scene: neither of the batch size nor of threads. Different keys give
  // independent estimates. `progress` is called between batches with the
  // fraction done; may be empty.
  std::vector<Rgb> Irradiance(std::span<const Receiver> receivers,
                              uint64_t key,
                              std::span<const uint32_t> strata,
                              GatherMode mode,
                              const std::function<void(double)>& progress);

  // With as many strata for all.
  std::vector<Rgb> Irradiance(std::span<const Receiver> receivers,
                              uint64_t key,
                              uint32_t strata,
                              GatherMode mode,
                              const std::function<void(double)>& progress);

  // Rays traced so far.
  [[nodiscard]] uint64_t Rays() const { return rays_traced_; }

  // For tests: paths traced together.
  void SetBatchPaths(size_t paths) { batch_paths_ = paths; }

  [[nodiscard]] SurfaceReader& Surfaces() { return surfaces_; }

 private:
  // Where a path begins: at a receiver, in one of its strata^2 strata.
  struct PathStart {
    uint32_t receiver = 0;
    uint32_t strata = 1;
    uint32_t stratum = 0;
  };

  // A path at its latest vertex.
  struct Path {
    Point3 position;  // a little above the surface
    Vec3 normal;
    std::optional<CellId> cell;
    Rgb throughput{1, 1, 1};
    Rgb sum{};
    double excess = 1;  // of the direction that it goes on in
    Random random{0};
    PathStart start;
    bool alive = true;
  };

  // An emitter's sample, to be added if nothing blocks it.
  struct LightSample {
    bool valid = false;
    TraceRay ray;
    Rgb value{};
  };

  void Start(std::span<const Receiver> receivers, uint64_t key);
  void MakeRays(bool first);
  void TraceRays();
  void AddLight();
  void AddField();
  void Advance(GatherMode mode);
  void Compact();
  [[nodiscard]] static TraceRay ScatteredRay(Path& path,
                                             const PathGuide::Aims& aims,
                                             bool first);
  [[nodiscard]] LightSample SampleLight(Path& path,
                                        const PathGuide::Aims& aims,
                                        bool first) const;
  void AddEmission(Path& path,
                   const TraceRay& ray,
                   const TraceHit& hit,
                   const Surface& surface) const;

  const BuildingView* view_;
  double offset_;
  EmitterTree emitters_;
  SeenEmitters seen_;
  PathGuide guide_;
  SurfaceReader surfaces_;
  size_t batch_paths_;
  MemoryCharge batch_charge_;
  uint64_t rays_traced_ = 0;

  // One batch. Scattered rays of the active paths come first in rays_, then
  // the rays to lights.
  std::vector<PathStart> starts_;
  std::vector<Path> paths_;
  std::vector<uint32_t> active_;
  std::vector<LightSample> lights_;
  std::vector<uint32_t> light_owner_;
  std::vector<TraceRay> rays_;
  std::vector<TraceHit> hits_;
  std::vector<Surface> hit_surfaces_;
};

}  // namespace enfilade
