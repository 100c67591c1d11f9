#include "tools/verify/paths.h"

#include "base/parallel.h"
#include "base/stop.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace enfilade {
namespace {

constexpr uint64_t kPathBytes = 768;  // of a path in all arrays of a batch
constexpr uint64_t kMostBytes = 64ULL << 20;  // of emitters, of surfaces
// Emitters and surfaces each take one part in so many of the free budget.
// Emitters take only what they need. Light of those that do not fit is found by
// chance alone. Surfaces need less room if the batches take most of it, because
// every batch reads every cell at most once per reflection.
constexpr uint64_t kEmittersParts = 4;
constexpr uint64_t kSurfacesParts = 3;
constexpr uint64_t kSurfacesPartsBesideMost = 8;
constexpr size_t kLeastBatch = 1024;
constexpr size_t kMostBatch = 65536;
constexpr size_t kBlock = 1024;  // paths of one parallel task

void AddProduct(Rgb& sum, const Rgb& a, const Rgb& b, double factor) {
  for (size_t c = 0; c < kRgbChannels; ++c) {
    sum[c] += a[c] * b[c] * factor;
  }
}

uint64_t MostPatchBytes(const BuildingView& view) {
  uint64_t most_patches = 0;
  for (const CellInfo& cell : view.partition->cells) {
    most_patches = std::max<uint64_t>(most_patches, cell.patches);
  }
  return most_patches * sizeof(Patch);
}

uint64_t SurfaceBytes(const MemoryBudget& budget, BatchRoom room) {
  const uint64_t parts =
      room == BatchRoom::kMost ? kSurfacesPartsBesideMost : kSurfacesParts;
  return std::min(budget.FreeBytes() / parts, kMostBytes);
}

size_t BatchPaths(const BuildingView& view,
                  const MemoryBudget& budget,
                  BatchRoom room) {
  const uint64_t free_bytes = budget.FreeBytes();
  const auto share =
      std::clamp(static_cast<size_t>(free_bytes / 6 / kPathBytes),
                 kLeastBatch,
                 kMostBatch);
  if (room == BatchRoom::kShare) {
    return share;
  }
  const uint64_t left_bytes =
      free_bytes - std::min(free_bytes, MostPatchBytes(view));
  return std::clamp(
      static_cast<size_t>(left_bytes / 4 * 3 / kPathBytes), share, kMostBatch);
}

}  // namespace

PathTracer::PathTracer(const BuildingView& view,
                       MemoryBudget& budget,
                       uint64_t emitter_bytes,
                       BatchRoom room)
    : view_(&view),
      offset_(RayOffset(view.scene->bounds)),
      emitters_(view, budget, emitter_bytes),
      seen_(emitters_),
      surfaces_(view, budget, SurfaceBytes(budget, room)),
      batch_paths_(BatchPaths(view, budget, room)),
      batch_charge_(budget, batch_paths_ * kPathBytes, "a batch of paths") {}

PathTracer::PathTracer(const BuildingView& view,
                       MemoryBudget& budget,
                       BatchRoom room)
    : PathTracer(view,
                 budget,
                 std::min(budget.FreeBytes() / kEmittersParts, kMostBytes),
                 room) {}

void PathTracer::LearnEmitters(MemoryBudget& budget, uint64_t key) {
  rays_traced_ += seen_.Learn(
      *view_, budget, std::min(budget.FreeBytes() / 2, kMostBytes), key);
}

void PathTracer::LearnBrightParts(std::vector<BrightPart> parts,
                                  double mean_radiosity,
                                  MemoryBudget& budget,
                                  uint64_t key) {
  rays_traced_ += guide_.Learn(*view_,
                               std::move(parts),
                               mean_radiosity,
                               budget,
                               std::min(budget.FreeBytes() / 8, kMostBytes),
                               key);
}

std::vector<Rgb> PathTracer::Irradiance(
    std::span<const Receiver> receivers,
    uint64_t key,
    uint32_t strata,
    GatherMode mode,
    const std::function<void(double)>& progress) {
  const std::vector<uint32_t> each(receivers.size(), strata);
  return Irradiance(receivers, key, each, mode, progress);
}

std::vector<Rgb> PathTracer::Irradiance(
    std::span<const Receiver> receivers,
    uint64_t key,
    std::span<const uint32_t> strata,
    GatherMode mode,
    const std::function<void(double)>& progress) {
  std::vector<Rgb> result(receivers.size());
  PathQueue queue(receivers, strata, *view_, mode);
  const uint64_t all = queue.Paths();
  for (uint64_t done = 0; done < all;) {
    queue.TakeBatch(batch_paths_, &starts_);
    Start(receivers, key);
    for (bool first_vertex = true; !active_.empty(); first_vertex = false) {
      ThrowIfStopRequested();
      MakeRays(first_vertex);
      TraceRays();
      AddLight();
      if (mode == GatherMode::kField) {
        AddField();
      }
      Advance(mode);
      Compact();
    }
    for (const Path& path : paths_) {
      AddProduct(result[path.start.receiver], path.sum, {1, 1, 1}, 1);
    }
    done += starts_.size();
    if (progress) {
      progress(static_cast<double>(done) / static_cast<double>(all));
    }
  }
  for (size_t i = 0; i < result.size(); ++i) {
    const double paths = static_cast<double>(strata[i]) * strata[i];
    for (double& channel : result[i]) {
      channel /= paths;
    }
  }
  return result;
}

void PathTracer::Start(std::span<const Receiver> receivers, uint64_t key) {
  paths_.resize(starts_.size());
  active_.resize(starts_.size());
  ParallelForInBlocks(starts_.size(), kBlock, [&](size_t i) {
    const PathStart& start = starts_[i];
    const Receiver& r = receivers[start.receiver];
    Path path;
    path.position = r.position + r.normal * offset_;
    path.normal = r.normal;
    path.cell = r.cell;
    path.start = start;
    path.random = Random(MixKey(MixKey(key, start.receiver), start.stratum));
    paths_[i] = path;
    active_[i] = static_cast<uint32_t>(i);
  });
}

void PathTracer::MakeRays(bool first) {
  rays_.resize(active_.size());
  lights_.resize(active_.size());
  ParallelForInBlocks(active_.size(), kBlock, [&](size_t i) {
    Path& path = paths_[active_[i]];
    const PathGuide::Aims aims =
        guide_.At(path.cell, path.position, path.normal);
    rays_[i] = ScatteredRay(path, aims, first);
    lights_[i] = SampleLight(path, aims, first);
  });
  light_owner_.clear();
  for (size_t i = 0; i < active_.size(); ++i) {
    if (lights_[i].valid) {
      light_owner_.push_back(static_cast<uint32_t>(i));
      rays_.push_back(lights_[i].ray);
    }
  }
}

TraceRay PathTracer::ScatteredRay(Path& path,
                                  const PathGuide::Aims& aims,
                                  bool first) {
  double u = path.random.Next();
  double v = path.random.Next();
  if (first) {
    const uint32_t strata = path.start.strata;
    const uint32_t row = path.start.stratum / strata;
    const uint32_t column = path.start.stratum % strata;
    u = (row + u) / strata;
    v = (column + v) / strata;
  }
  TraceRay ray;
  ray.origin = path.position;
  ray.direction = aims.Direction(u, v);
  path.excess = aims.Excess(ray.direction);
  return ray;
}

PathTracer::LightSample PathTracer::SampleLight(Path& path,
                                                const PathGuide::Aims& aims,
                                                bool first) const {
  double choice = path.random.Next();
  const double s = path.random.Next();
  const double t = path.random.Next();
  if (first) {
    // One stratum of the choice per path.
    const double count =
        static_cast<double>(path.start.strata) * path.start.strata;
    choice =
        std::min((path.start.stratum + choice) / count, 0x1.fffffffffffffp-1);
  }
  LightSample sample;
  const auto chosen =
      seen_.Choose(path.cell, path.position, path.normal, choice);
  if (!chosen) {
    return sample;
  }
  const Emitter& e = *chosen->emitter;
  const Point3 y = PointOnEmitter(e, s, t).position;
  const double g = GeometryTerm(path.position, path.normal, y, e.normal);
  if (g <= 0) {
    return sample;
  }
  const double density = chosen->probability / e.area;
  sample.valid = true;
  sample.ray.origin = path.position;
  sample.ray.direction = (y + e.normal * offset_) - path.position;
  sample.ray.max_distance = 1;
  AddProduct(sample.value,
             path.throughput,
             view_->scene->materials[e.material.Index()].exitance,
             g / (aims.Excess(Normalize(y - path.position)) * g + density));
  return sample;
}

void PathTracer::TraceRays() {
  hits_.resize(rays_.size());
  view_->trace(rays_, hits_);
  rays_traced_ += rays_.size();
  hit_surfaces_.resize(active_.size());
  surfaces_.Read(std::span(rays_).first(active_.size()),
                 std::span(hits_).first(active_.size()),
                 hit_surfaces_);
}

void PathTracer::AddLight() {
  for (size_t k = 0; k < light_owner_.size(); ++k) {
    if (!hits_[active_.size() + k].hit) {
      const uint32_t owner = light_owner_[k];
      AddProduct(
          paths_[active_[owner]].sum, lights_[owner].value, {1, 1, 1}, 1);
    }
  }
}

// Adds the reflected light of the field where the rays hit. AddLight and
// AddEmission add the emission.
void PathTracer::AddField() {
  std::vector<PatchPoint> points;
  std::vector<uint32_t> owners;
  for (size_t i = 0; i < active_.size(); ++i) {
    const Surface& surface = hit_surfaces_[i];
    if (surface.front && MaxChannel(surface.reflectance) > 0) {
      points.push_back({hits_[i].cell, hits_[i].patch, hits_[i].a, hits_[i].b});
      owners.push_back(static_cast<uint32_t>(i));
    }
  }
  const std::vector<Rgb> radiosity = view_->radiosity(points);
  for (size_t k = 0; k < points.size(); ++k) {
    Path& path = paths_[active_[owners[k]]];
    AddProduct(path.sum, path.throughput, radiosity[k], 1 / path.excess);
    AddProduct(path.sum,
               path.throughput,
               hit_surfaces_[owners[k]].exitance,
               -1 / path.excess);
  }
}

void PathTracer::AddEmission(Path& path,
                             const TraceRay& ray,
                             const TraceHit& hit,
                             const Surface& surface) const {
  if (MaxChannel(surface.exitance) <= 0) {
    return;
  }
  const double density = seen_.Density(
      path.cell, ray.origin, path.normal, {hit.cell, hit.patch, hit.a, hit.b});
  const double g =
      GeometryTerm(ray.origin, path.normal, surface.position, surface.normal);
  const double weight =
      density > 0 ? g / (path.excess * g + density) : 1 / path.excess;
  AddProduct(path.sum, path.throughput, surface.exitance, weight);
}

void PathTracer::Advance(GatherMode mode) {
  ParallelForInBlocks(active_.size(), kBlock, [&](size_t i) {
    Path& path = paths_[active_[i]];
    const Surface& surface = hit_surfaces_[i];
    path.alive = false;
    if (!surface.front) {
      return;
    }
    AddEmission(path, rays_[i], hits_[i], surface);
    const double survival = MaxChannel(surface.reflectance);
    if (mode == GatherMode::kField || path.random.Next() >= survival) {
      return;
    }
    for (size_t c = 0; c < kRgbChannels; ++c) {
      path.throughput[c] *= surface.reflectance[c] / survival / path.excess;
    }
    path.position = surface.position + surface.normal * offset_;
    path.normal = surface.normal;
    path.cell = hits_[i].cell;
    path.alive = true;
  });
}

void PathTracer::Compact() {
  std::erase_if(active_, [&](uint32_t i) { return !paths_[i].alive; });
}

}  // namespace enfilade
