// Chunks are paged in when rays need them. The answers of chunks are combined
// in a way that does not depend on which chunks were in memory
// (loaded_chunk.h).

#include "visibility/ray_tracer.h"

#include "base/check.h"
#include "base/parallel.h"
#include "visibility/embree.h"
#include "visibility/loaded_chunk.h"
#include "visibility/trace_chunk.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

namespace enfilade {
namespace {

// Chunk boxes are enlarged by this to allow for the rounding of vertices.
constexpr double kBoxMarginMetres = 1e-3;

constexpr size_t kRaysPerTask = 256;
constexpr size_t kLeastBatch = 4096;
constexpr size_t kMostBatch = 1U << 20;

// A ray prepared for intersection with boxes.
struct BoxRay {
  Point3 origin;
  Vec3 inverse;

  explicit BoxRay(const TraceRay& ray) : origin(ray.origin) {
    const auto invert = [](double d) {
      return 1.0 / (std::abs(d) < 1e-150 ? 1e-150 : d);
    };
    inverse = {invert(ray.direction.x),
               invert(ray.direction.y),
               invert(ray.direction.z)};
  }

  // The distance at which the ray enters the box; kNoHitDistance if the ray
  // enters the box after `end` or never.
  [[nodiscard]] double Enter(const Box3& box, double end) const {
    double near = 0;
    double far = end;
    for (size_t k = 0; k < 3; ++k) {
      const double t0 = (box.low[k] - origin[k]) * inverse[k];
      const double t1 = (box.high[k] - origin[k]) * inverse[k];
      near = std::max(near, std::min(t0, t1));
      far = std::min(far, std::max(t0, t1));
    }
    if (near <= far) {
      return near;
    }
    return kNoHitDistance;
  }
};

}  // namespace

struct RayTracer::Impl {
  Impl(const BlockStorage& store_in, MemoryBudget& budget_in)
      : store(&store_in),
        budget(&budget_in),
        device(EmbreeDevice::Create(budget_in)),
        table(LoadTraceTable(store_in)),
        share_bytes(budget_in.FreeBytes() / 2),
        chunks(table.size()) {
    for (TraceChunkInfo& info : table) {
      const Vec3 margin{kBoxMarginMetres, kBoxMarginMetres, kBoxMarginMetres};
      info.bounds.low = info.bounds.low - margin;
      info.bounds.high = info.bounds.high + margin;
    }
  }

  [[nodiscard]] size_t BatchSize(size_t rays) const {
    const size_t fitting = share_bytes / 8 / sizeof(RayState);
    return std::min(rays, std::clamp(fitting, kLeastBatch, kMostBatch));
  }

  void TraceBatch(std::span<const TraceRay> rays, std::span<TraceHit> hits);
  std::vector<size_t> NextGroup(std::vector<size_t>& remaining,
                                std::span<const TraceRay> rays,
                                std::span<const RayState> states);
  [[nodiscard]] bool IsWanted(size_t chunk,
                              std::span<const TraceRay> rays,
                              std::span<const RayState> states) const;
  void Load(size_t chunk, const std::vector<size_t>& keep);
  void EvictAllBut(const std::vector<size_t>& keep, uint64_t target_bytes);
  void HoldResident(const std::vector<size_t>& keep, uint64_t coming_bytes);
  void TraceInGroup(std::span<const size_t> group,
                    const TraceRay& ray,
                    RayState& state) const;

  const BlockStorage* store;
  MemoryBudget* budget;
  std::shared_ptr<EmbreeDevice> device;
  std::vector<TraceChunkInfo> table;
  uint64_t share_bytes;
  // Null if the chunk is not in memory.
  std::vector<std::unique_ptr<LoadedChunk>> chunks;
  uint64_t loaded_bytes = 0;
};

bool RayTracer::Impl::IsWanted(size_t chunk,
                               std::span<const TraceRay> rays,
                               std::span<const RayState> states) const {
  for (size_t i = 0; i < rays.size(); ++i) {
    if (BoxRay(rays[i]).Enter(table[chunk].bounds, Reach(rays[i], states[i])) <
        kNoHitDistance) {
      return true;
    }
  }
  return false;
}

void RayTracer::Impl::EvictAllBut(const std::vector<size_t>& keep,
                                  uint64_t target_bytes) {
  for (size_t i = 0; i < chunks.size() && loaded_bytes > target_bytes; ++i) {
    if (chunks[i] != nullptr &&
        std::find(keep.begin(), keep.end(), i) == keep.end()) {
      loaded_bytes -= chunks[i]->Bytes();
      chunks[i].reset();
    }
  }
}

// Evicts chunks if the resident size of the process comes near the cap, because
// the allocator may keep more than is charged.
void RayTracer::Impl::HoldResident(const std::vector<size_t>& keep,
                                   uint64_t coming_bytes) {
  if (budget->ResidentExcess(coming_bytes) > 0) {
    ReleaseFreedMemory();
    const uint64_t excess = budget->ResidentExcess(coming_bytes);
    EvictAllBut(keep, loaded_bytes - std::min(loaded_bytes, excess));
  }
}

void RayTracer::Impl::Load(size_t chunk, const std::vector<size_t>& keep) {
  const uint64_t expected = LoadedChunk::LoadingBytes(table[chunk].primitives);
  EvictAllBut(keep, share_bytes - std::min(share_bytes, expected));
  HoldResident(keep, expected);
  auto loaded = std::make_unique<LoadedChunk>(
      *store, chunk, table[chunk].primitives, *device, *budget);
  loaded_bytes += loaded->Bytes();
  chunks[chunk] = std::move(loaded);
}

// Takes from `remaining` the chunks to trace next: those in memory, if there
// are any; otherwise as many as the share holds of those that a ray needs, and
// at least one of them.
std::vector<size_t> RayTracer::Impl::NextGroup(
    std::vector<size_t>& remaining,
    std::span<const TraceRay> rays,
    std::span<const RayState> states) {
  std::vector<size_t> group;
  const auto in_memory = [&](size_t c) { return chunks[c] != nullptr; };
  std::copy_if(
      remaining.begin(), remaining.end(), std::back_inserter(group), in_memory);
  std::erase_if(remaining, in_memory);
  if (!group.empty()) {
    return group;
  }
  size_t taken = 0;
  for (; taken < remaining.size(); ++taken) {
    const size_t chunk = remaining[taken];
    const uint64_t expected = LoadedChunk::HeldBytes(table[chunk].primitives);
    uint64_t held = 0;
    for (const size_t c : group) {
      held += chunks[c]->Bytes();
    }
    if (!group.empty() && held + expected > share_bytes) {
      break;
    }
    if (IsWanted(chunk, rays, states)) {
      Load(chunk, group);
      group.push_back(chunk);
    }
  }
  remaining.erase(remaining.begin(),
                  remaining.begin() + static_cast<ptrdiff_t>(taken));
  return group;
}

// Traces the ray through the chunks from near to far, until its nearest hit is
// nearer than the next chunk.
void RayTracer::Impl::TraceInGroup(std::span<const size_t> group,
                                   const TraceRay& ray,
                                   RayState& state) const {
  thread_local std::vector<std::pair<double, size_t>> entries;
  entries.clear();
  const BoxRay box_ray(ray);
  const double reach = Reach(ray, state);
  for (const size_t chunk : group) {
    const double enter = box_ray.Enter(table[chunk].bounds, reach);
    if (enter < kNoHitDistance) {
      entries.emplace_back(enter, chunk);
    }
  }
  std::sort(entries.begin(), entries.end());
  for (const auto& [enter, chunk] : entries) {
    if (enter > Reach(ray, state)) {
      break;
    }
    chunks[chunk]->Trace(ray, enter, &state);
  }
}

void RayTracer::Impl::TraceBatch(std::span<const TraceRay> rays,
                                 std::span<TraceHit> hits) {
  const MemoryCharge charge(
      *budget, rays.size() * sizeof(RayState), "the state of rays");
  std::vector<RayState> states(rays.size());
  std::vector<size_t> remaining(chunks.size());
  for (size_t i = 0; i < remaining.size(); ++i) {
    remaining[i] = i;
  }
  const size_t tasks = (rays.size() + kRaysPerTask - 1) / kRaysPerTask;
  const auto for_rays = [&](const auto& body) {
    ParallelFor(tasks, [&](size_t task) {
      const size_t end = std::min(rays.size(), (task + 1) * kRaysPerTask);
      for (size_t i = task * kRaysPerTask; i < end; ++i) {
        body(i);
      }
    });
  };
  while (!remaining.empty()) {
    const std::vector<size_t> group = NextGroup(remaining, rays, states);
    for_rays([&](size_t i) { TraceInGroup(group, rays[i], states[i]); });
  }
  for_rays([&](size_t i) { hits[i] = Resolve(states[i], rays[i].direction); });
}

RayTracer::RayTracer(const BlockStorage& store, MemoryBudget& budget)
    : impl_(std::make_unique<Impl>(store, budget)) {}

RayTracer::~RayTracer() = default;

void RayTracer::Trace(std::span<const TraceRay> rays,
                      std::span<TraceHit> hits) {
  ENFILADE_CHECK(
      rays.size() == hits.size(), "{} rays, {} hits", rays.size(), hits.size());
  if (rays.empty()) {
    return;
  }
  const size_t batch = impl_->BatchSize(rays.size());
  for (size_t first = 0; first < rays.size(); first += batch) {
    const size_t count = std::min(batch, rays.size() - first);
    impl_->TraceBatch(rays.subspan(first, count), hits.subspan(first, count));
  }
}

}  // namespace enfilade
