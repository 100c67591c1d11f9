// Irradiance at points by Monte Carlo: unbiased path tracing, or one bounce of
// final gathering into a known field.
//
// Everything is in radiosity units: with directions in proportion to the
// cosine, the irradiance at x is the mean of the radiosity that its rays meet,
//
//   H(x) = E[ B(y) ],   B(y) = E_e(y) + rho(y) H(y).
//
// Emission is estimated both by the rays and by sampled emitters, weighted by
// the balance heuristic (Veach & Guibas 1995) in the measure of area at y. A
// ray has the density e G(x, y) = e cos_x cos_y / (pi r^2), and a sample of an
// emitter has the density P / A, so either one contributes E_e G / (e G + P /
// A). Without a guide (guide.h) the excess e is 1 and the contribution is at
// most E_e. Paths end by Russian roulette on the reflectance.

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
#include "tools/verify/path_queue.h"
#include "tools/verify/seen.h"

namespace enfilade {

// How much of the free budget a batch of paths takes. If the building does not
// fit the memory, every batch reads it again.
enum class BatchRoom {
  kShare,  // a sixth, because later parts need memory too
  kMost,   // three quarters of what the largest cell's patches leave
};

class PathTracer {
 public:
  // Takes a share of the free budget for surfaces and a batch of paths, and at
  // most `emitter_bytes` for emitters. The view must outlive this.
  PathTracer(const BuildingView& view,
             MemoryBudget& budget,
             uint64_t emitter_bytes,
             BatchRoom room = BatchRoom::kShare);
  PathTracer(const BuildingView& view,
             MemoryBudget& budget,
             BatchRoom room = BatchRoom::kShare);

  // Finds by rays which emitters the cells see. Receivers with a known cell and
  // all later vertices use the result. Worth its time only before many paths.
  // Takes up to half of the free budget.
  void LearnEmitters(MemoryBudget& budget, uint64_t key);

  // Guides paths to bright parts, with the arguments of `PathGuide::Learn`.
  // Takes up to an eighth of the free budget.
  void LearnBrightParts(std::vector<BrightPart> parts,
                        double mean_radiosity,
                        MemoryBudget& budget,
                        uint64_t key);

  // Returns the mean over strata[i]^2 paths for every receiver i, stratified in
  // the first direction. The result is a pure function of the arguments and the
  // scene, independent of the batch size and of threads. Different keys give
  // independent estimates. `progress` is called between batches with the
  // fraction done; may be empty.
  std::vector<Rgb> Irradiance(std::span<const Receiver> receivers,
                              uint64_t key,
                              std::span<const uint32_t> strata,
                              GatherMode mode,
                              const std::function<void(double)>& progress);

  // As above, with the same number of strata for all receivers.
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
  // A path at its latest vertex.
  struct Path {
    Point3 position;  // a little above the surface
    Vec3 normal;
    std::optional<CellId> cell;
    Rgb throughput{1, 1, 1};
    Rgb sum{};
    double excess = 1;  // e, of the latest direction
    Random random{0};
    PathStart start;
    bool alive = true;
  };

  // A sample of an emitter, added if nothing blocks its ray.
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
