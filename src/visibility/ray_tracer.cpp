// Chunks are paged in when rays need them. The answers of chunks are combined
// in a way that does not depend on which chunks were in memory
// (loaded_chunk.h).

#include "visibility/ray_tracer.h"

#include "base/check.h"
#include "base/parallel.h"
#include "scene/box_tree.h"
#include "visibility/embree.h"
#include "visibility/loaded_chunk.h"
#include "visibility/trace_chunk.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <optional>
#include <utility>

namespace enfilade {
namespace {

// Chunk boxes are enlarged by this to allow for the rounding of vertices.
constexpr double kBoxMarginMetres = 1e-3;

// A part of the building meets the chunks around it, too.
constexpr uint64_t kPartsPerShare = 3;

constexpr size_t kRaysPerTask = 256;
constexpr size_t kLeastBatch = 4096;
constexpr size_t kMostBatch = 1U << 20;

constexpr uint64_t kBytesPerRay = sizeof(RayState) + sizeof(uint32_t);
constexpr uint32_t kNoChunk = ~0U;

// Where a batch of rays is with a chunk.
enum class Turn : uint8_t {
  kToCome,
  kNow,  // the chunk is in memory, and the rays go through it
  kDone,
};

// The boxes of chunks, enlarged.
std::vector<Box3> BoxesOf(const std::vector<TraceChunkInfo>& table) {
  std::vector<Box3> boxes;
  boxes.reserve(table.size());
  for (const TraceChunkInfo& info : table) {
    boxes.push_back(Grown(info.bounds, kBoxMarginMetres));
  }
  return boxes;
}

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
        boxes(BoxesOf(table)),
        tree(boxes),
        share_bytes(budget_in.FreeBytes() / 2),
        chunks(table.size()),
        last_met(table.size()) {}

  [[nodiscard]] size_t BatchSize(size_t rays) const {
    const size_t fitting = share_bytes / 8 / kBytesPerRay;
    return std::min(rays, std::clamp(fitting, kLeastBatch, kMostBatch));
  }

  [[nodiscard]] size_t Parts() const {
    uint64_t bytes = 0;
    for (const TraceChunkInfo& info : table) {
      bytes += LoadedChunk::HeldBytes(info.primitives);
    }
    if (bytes <= share_bytes) {
      return 1;
    }
    const uint64_t shares = bytes / std::max<uint64_t>(share_bytes, 1) + 1;
    return std::min<uint64_t>(kPartsPerShare * shares, table.size());
  }

  void TraceBatch(std::span<const TraceRay> rays, std::span<TraceHit> hits);
  bool StartTurns(std::span<const TraceRay> rays,
                  std::span<const RayState> states,
                  std::vector<Turn>* turns);
  [[nodiscard]] uint32_t NearestOf(const std::vector<Turn>& turns,
                                   const TraceRay& ray,
                                   const RayState& state) const;
  std::vector<size_t> LoadWanted(std::span<const uint32_t> nearest);
  void Load(size_t chunk, const std::vector<size_t>& keep);
  void EvictAllBut(const std::vector<size_t>& keep, uint64_t target_bytes);
  void HoldResident(const std::vector<size_t>& keep, uint64_t coming_bytes);
  void TraceNow(const std::vector<Turn>& turns,
                const TraceRay& ray,
                RayState& state);

  const BlockStorage* store;
  MemoryBudget* budget;
  std::shared_ptr<EmbreeDevice> device;
  std::vector<TraceChunkInfo> table;
  std::vector<Box3> boxes;  // of the chunks
  BoxTree tree;             // of `boxes`
  uint64_t share_bytes;
  // Null if the chunk is not in memory.
  std::vector<std::unique_ptr<LoadedChunk>> chunks;
  uint64_t loaded_bytes = 0;
  // By chunk, the number of the latest turn in which a ray met its box.
  std::vector<std::atomic<uint64_t>> last_met;
  uint64_t turns_so_far = 0;
};

// Evicts the chunks first that no ray has met for the longest time.
void RayTracer::Impl::EvictAllBut(const std::vector<size_t>& keep,
                                  uint64_t target_bytes) {
  while (loaded_bytes > target_bytes) {
    std::optional<size_t> oldest;
    for (size_t i = 0; i < chunks.size(); ++i) {
      if (chunks[i] != nullptr &&
          std::find(keep.begin(), keep.end(), i) == keep.end() &&
          (!oldest || last_met[i] < last_met[*oldest])) {
        oldest = i;
      }
    }
    if (!oldest) {
      return;
    }
    loaded_bytes -= chunks[*oldest]->Bytes();
    chunks[*oldest].reset();
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

// Loads, of the chunks that are nearest to some ray, those nearest to most
// rays, as many as the share holds and at least one. A ray to a far lamp thus
// loads what lies behind the first wall only if the wall does not stop it.
std::vector<size_t> RayTracer::Impl::LoadWanted(
    std::span<const uint32_t> nearest) {
  std::vector<size_t> rays_of(table.size());
  for (const uint32_t chunk : nearest) {
    if (chunk != kNoChunk) {
      ++rays_of[chunk];
    }
  }
  std::vector<size_t> wanted;
  for (size_t c = 0; c < rays_of.size(); ++c) {
    if (rays_of[c] > 0) {
      wanted.push_back(c);
    }
  }
  std::stable_sort(wanted.begin(), wanted.end(), [&](size_t a, size_t b) {
    return rays_of[a] > rays_of[b];
  });
  std::vector<size_t> group;
  uint64_t held = 0;
  for (const size_t chunk : wanted) {
    const uint64_t expected = LoadedChunk::HeldBytes(table[chunk].primitives);
    if (!group.empty() && held + expected > share_bytes) {
      break;
    }
    Load(chunk, group);
    held += chunks[chunk]->Bytes();
    group.push_back(chunk);
  }
  return group;
}

// The chunk to come that the ray enters first; kNoChunk if it reaches none.
uint32_t RayTracer::Impl::NearestOf(const std::vector<Turn>& turns,
                                    const TraceRay& ray,
                                    const RayState& state) const {
  const BoxRay box_ray(ray);
  double reach = Reach(ray, state);
  uint32_t nearest = kNoChunk;
  tree.ForThose(
      [&](const Box3& box) {
        return box_ray.Enter(box, reach) < kNoHitDistance;
      },
      [&](uint32_t chunk) {
        if (turns[chunk] != Turn::kToCome) {
          return;
        }
        const double enter = box_ray.Enter(boxes[chunk], reach);
        nearest = enter < reach ? chunk : std::min(nearest, chunk);
        reach = enter;
      });
  return nearest;
}

// Lets the chunks in memory that are to come have their turn or, if there are
// none, loads some. Returns false if no ray reaches a chunk that is to come.
bool RayTracer::Impl::StartTurns(std::span<const TraceRay> rays,
                                 std::span<const RayState> states,
                                 std::vector<Turn>* turns) {
  bool any = false;
  bool any_to_come = false;
  for (size_t c = 0; c < chunks.size(); ++c) {
    Turn& turn = (*turns)[c];
    any_to_come |= turn == Turn::kToCome;
    if (turn == Turn::kToCome && chunks[c] != nullptr) {
      turn = Turn::kNow;
      any = true;
    }
  }
  if (any || !any_to_come) {
    return any;
  }
  std::vector<uint32_t> nearest(rays.size());
  ParallelForInBlocks(rays.size(), kRaysPerTask, [&](size_t i) {
    nearest[i] = NearestOf(*turns, rays[i], states[i]);
  });
  for (const size_t chunk : LoadWanted(nearest)) {
    (*turns)[chunk] = Turn::kNow;
    any = true;
  }
  return any;
}

// Traces the ray through the chunks whose turn it is, from near to far, until
// its nearest hit is nearer than the next chunk.
void RayTracer::Impl::TraceNow(const std::vector<Turn>& turns,
                               const TraceRay& ray,
                               RayState& state) {
  thread_local std::vector<std::pair<double, size_t>> entries;
  entries.clear();
  const BoxRay box_ray(ray);
  const double reach = Reach(ray, state);
  tree.ForThose(
      [&](const Box3& box) {
        return box_ray.Enter(box, reach) < kNoHitDistance;
      },
      [&](uint32_t chunk) {
        if (turns[chunk] == Turn::kNow) {
          entries.emplace_back(box_ray.Enter(boxes[chunk], reach), chunk);
        }
      });
  std::sort(entries.begin(), entries.end());
  for (const auto& [enter, chunk] : entries) {
    if (enter > Reach(ray, state)) {
      break;
    }
    if (last_met[chunk].load(std::memory_order_relaxed) != turns_so_far) {
      last_met[chunk].store(turns_so_far, std::memory_order_relaxed);
    }
    chunks[chunk]->Trace(ray, enter, &state);
  }
}

void RayTracer::Impl::TraceBatch(std::span<const TraceRay> rays,
                                 std::span<TraceHit> hits) {
  const MemoryCharge charge(
      *budget, rays.size() * kBytesPerRay, "the state of rays");
  std::vector<RayState> states(rays.size());
  std::vector<Turn> turns(chunks.size(), Turn::kToCome);
  while (StartTurns(rays, states, &turns)) {
    ++turns_so_far;
    ParallelForInBlocks(rays.size(), kRaysPerTask, [&](size_t i) {
      TraceNow(turns, rays[i], states[i]);
    });
    std::replace(turns.begin(), turns.end(), Turn::kNow, Turn::kDone);
  }
  ParallelForInBlocks(rays.size(), kRaysPerTask, [&](size_t i) {
    hits[i] = Resolve(states[i], rays[i].direction);
  });
}

double RayOffset(const Box3& scene_bounds) {
  const double size =
      scene_bounds.IsEmpty() ? 0 : Length(scene_bounds.Extent());
  // The second is two float steps of a chunk as wide as the scene.
  return std::max(std::clamp(1e-6 * size, 1e-5, kRayOffsetMetres), 1e-7 * size);
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

size_t RayTracer::Parts() const {
  return impl_->Parts();
}

}  // namespace enfilade
