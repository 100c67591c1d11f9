#include "solver/residual/residual_check.h"

#include "base/error.h"
#include "base/random.h"
#include "partition/partition.h"
#include "partition/partition_store.h"
#include "solver/residual/lamps.h"
#include "solver/residual/reflected_error.h"
#include "solver/residual/residual_probes.h"
#include "solver/residual/residual_rays.h"
#include "solver/solution/solution.h"
#include "visibility/ray_tracer.h"
#include "visibility/visible_set.h"

#include <algorithm>
#include <memory>
#include <utility>
#include <vector>

namespace enfilade {
namespace {

// Keeps the samples apart from those of every other part of the program.
constexpr uint64_t kSeedDomain = 0x726573696475616cULL;
// Points of each of the first rounds. The number doubles every four rounds, up
// to eight times the first.
constexpr uint32_t kPointsPerRound = 3072;
constexpr uint64_t kRoundsOfASize = 4;
constexpr uint64_t kMostDoublings = 3;
constexpr uint64_t kRaysPerPoint = ResidualSamples::kRaysPerProbe;

// Bytes of a point while its rays are traced, and of a point while the solution
// is looked up for it.
constexpr uint64_t kTracedBytes = ResidualRays::kBytesPerProbe;
constexpr uint64_t kPointBytes = BatchSight::kBytesPerProbe +
                                 sizeof(ResidualProbe) +
                                 ProbeChooser::kWorkBytesPerProbe;
constexpr uint64_t kMostTracedBytes = 8ULL << 20;
constexpr uint64_t kMostLookedUpBytes = 24ULL << 20;
constexpr size_t kLeastBatchPoints = 8;
// Tracing and look-up each take one part in so many of the free memory. The
// number of points that are looked up together determines how often cells are
// read; tracing few points at a time costs nothing if the building is in
// memory.
constexpr uint64_t kTracedParts = 8;
constexpr uint64_t kLookedUpParts = 4;

// How many points of `bytes` bytes each fit into `room`, within limits.
size_t PointsIn(uint64_t room, uint64_t bytes) {
  return std::clamp<uint64_t>(
      room / bytes, kLeastBatchPoints, kPointsPerRound << kMostDoublings);
}

// The first round runs whatever `most_rays` is; a later round runs only if all
// its rays are left.
size_t MostProbes(uint64_t most_rays) {
  return most_rays / kRaysPerPoint + kPointsPerRound;
}

size_t TracedPoints(const MemoryBudget& budget) {
  return PointsIn(std::min(budget.FreeBytes() / kTracedParts, kMostTracedBytes),
                  kTracedBytes);
}

// A point's bytes include the mean size of the list of cells that its cell
// sees.
size_t LookedUpPoints(const BlockStorage& store,
                      size_t cells,
                      const MemoryBudget& budget) {
  const uint64_t seen = LoadVisibilitySummary(store).visible_pairs /
                        std::max<size_t>(cells, 1) * sizeof(CellId);
  return PointsIn(
      std::min(budget.FreeBytes() / kLookedUpParts, kMostLookedUpBytes),
      kPointBytes + seen);
}

// Makes a tracer, which takes half of what is free beside a cell's solution.
std::unique_ptr<RayTracer> TracerBeside(const Solution& solution,
                                        const BlockStorage& store,
                                        MemoryBudget& budget) {
  const MemoryCharge room(
      budget, solution.MostCellBytes(), "a cell's solution");
  return std::make_unique<RayTracer>(store, budget);
}

class ResidualMeter {
 public:
  ResidualMeter(const BlockStorage& store,
                const ResidualOptions& options,
                MemoryBudget& budget)
      : options_(options),
        cells_(LoadCells(store)),
        solution_(store, budget),
        lamps_(store, solution_.Scene(), cells_.size(), budget),
        reflected_(cells_, budget),
        chooser_(store, cells_, solution_, options.mean_reflected, budget),
        by_patch_(
            chooser_.FirstPatches(), MostProbes(options.most_rays), budget),
        traced_points_(TracedPoints(budget)),
        batch_points_(LookedUpPoints(store, cells_.size(), budget)),
        batch_charge_(
            budget,
            traced_points_ * kTracedBytes + batch_points_ * kPointBytes,
            "rays of the residual"),
        tracer_(TracerBeside(solution_, store, budget)),
        rays_(lamps_, *tracer_, chooser_.Offset(), traced_points_),
        sum_({options.mean_reflected,
              chooser_.ReflectingArea(),
              options.unseen}) {}

  ResidualEstimate Run() {
    if (chooser_.IsEmpty()) {
      return {};
    }
    for (uint64_t round = 0;; ++round) {
      const auto points = static_cast<uint32_t>(
          kPointsPerRound << std::min(round / kRoundsOfASize, kMostDoublings));
      if (round > 0 &&
          (IsDone() || traced_ + points * kRaysPerPoint > options_.most_rays)) {
        return estimate_;
      }
      AddRound(MixKey(MixKey(kSeedDomain, options_.seed), round), points);
      estimate_ = sum_.Estimate(reflected_.Integral(), traced_);
      estimate_.lit_share = chooser_.LitShare();
    }
  }

  PatchErrors TakePatchErrors() {
    by_patch_.Sort();
    return std::move(by_patch_);
  }

 private:
  [[nodiscard]] bool IsDone() const {
    return IsDecided(estimate_, options_.decide_at, options_.least_rays);
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
    const ProbeBatch batch = chooser_.Choose(key, strata);
    BatchSight seen = rays_.Look(batch, reflected_);
    traced_ += batch.probes.size() * kRaysPerPoint;
    solution_.ForEachLight(seen.points,
                           [&](size_t point, const LightAtPoint& light) {
                             seen.AddLight(point, light);
                           });
    AddRays(batch, seen);
    for (size_t i = 0; i < batch.probes.size(); ++i) {
      AddResidual(batch.probes[i], seen.probes[i]);
    }
    if (options_.progress) {
      options_.progress(std::min(1.0,
                                 static_cast<double>(traced_) /
                                     static_cast<double>(options_.most_rays)),
                        estimate_);
    }
  }

  // Tells which groups of surface the rays of the probes connect.
  void AddRays(const ProbeBatch& batch, const BatchSight& seen) {
    for (const BatchSight::MetSurface& met : seen.met) {
      if (met.reflecting) {
        const size_t i = met.owner / ResidualSamples::kHalves;
        reflected_.AddRay(
            seen.probes[i].group,
            met.group,
            batch.probes[i].weight / ResidualSamples::kPointsPerProbe,
            solution_.Scene().materials[met.reflecting->Index()].reflectance);
      }
    }
  }

  void AddResidual(const ResidualProbe& probe, const ProbeSight& sight) {
    const Material& material =
        solution_.Scene().materials.at(probe.patch.material.Index());
    const Rgb& rho = material.reflectance;
    ErrorProbe seen{sight.group, probe.weight, {}, rho};
    double square = 0;
    for (size_t c = 0; c < kRgbChannels; ++c) {
      const double reflected =
          sight.solved[c] - (probe.patch.emits ? material.exitance[c] : 0.0);
      const double first = rho[c] * sight.arriving[0][c] - reflected;
      const double second = rho[c] * sight.arriving[1][c] - reflected;
      square += first * second / kRgbChannels;
      seen.residual[c] = (first + second) / 2;
    }
    reflected_.AddProbe(seen);
    by_patch_.Add(probe.on.cell,
                  probe.on.patch,
                  chooser_.ShareOf(probe.on.cell, probe.on.patch),
                  square * probe.weight);
    sum_.Add({probe.weight, square, sight.enclosed, rho});
  }

  ResidualOptions options_;
  std::vector<CellInfo> cells_;
  Solution solution_;
  Lamps lamps_;
  ReflectedError reflected_;
  ProbeChooser chooser_;
  PatchErrors by_patch_;
  size_t traced_points_;  // at a time
  size_t batch_points_;   // looked up at a time
  MemoryCharge batch_charge_;
  std::unique_ptr<RayTracer> tracer_;
  ResidualRays rays_;
  ResidualSum sum_;
  ResidualEstimate estimate_;  // from all finished rounds
  uint64_t traced_ = 0;        // rays
};

}  // namespace

uint64_t MostResidualRays(uint64_t links) {
  constexpr uint64_t kPerLink = 4;
  constexpr uint64_t kLeast = 8 << 20;
  return std::max(kLeast, kPerLink * links);
}

uint64_t LeastResidualBytes(size_t cells,
                            size_t patches,
                            size_t lamps,
                            uint64_t most_rays) {
  constexpr uint64_t kForRays = 5ULL << 20;
  return kForRays + Lamps::BytesFor(lamps) +
         ProbeChooser::BytesFor(patches, cells) +
         PatchErrors::BytesFor(cells, MostProbes(most_rays));
}

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
