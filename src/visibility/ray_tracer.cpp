// Each ray keeps the nearest hit on a front (a side whose normal faces the ray)
// and the nearest hit on a back over all chunks. A chunk's answer does not
// depend on what the ray met before, and answers are combined by (distance,
// cell, patch), so results do not depend on which chunks were in memory.

#include "visibility/ray_tracer.h"

#include "base/check.h"
#include "base/parallel.h"
#include "visibility/embree.h"
#include "visibility/trace_chunk.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <tuple>

#include <embree3/rtcore.h>

namespace enfilade {
namespace {

constexpr double kFar = std::numeric_limits<double>::infinity();

// Two sides of one wall are at most this far apart, measured along their
// normal: their vertices were rounded each for itself (trace_chunk.h).
constexpr double kSameWallMetres = 5e-5;
constexpr double kSameNormal = 0.999;

// Chunk boxes are enlarged by this for the rounding of their vertices.
constexpr double kBoxMarginMetres = 1e-3;

// Error of a distance in a chunk, generously.
constexpr double kSlackMetres = 1e-5;

constexpr size_t kRaysPerTask = 256;
constexpr size_t kLeastBatch = 4096;
constexpr size_t kMostBatch = 1U << 20;

struct SideHit {
  double distance = kFar;
  CellId cell;
  PatchId patch;
  float a = 0, b = 0;
  std::array<float, 3> normal{};  // of the patch, not normalised

  [[nodiscard]] auto Order() const {
    return std::make_tuple(distance, cell.value, patch.value);
  }
};

// What a ray has met so far.
struct RayState {
  SideHit front;
  SideHit back;
};

double CosineTo(const std::array<float, 3>& n, Vec3 d) {
  const Vec3 normal{n[0], n[1], n[2]};
  return Dot(normal, d) / (Length(normal) * Length(d));
}

// How far beyond a back, in lengths of d, the front of the same wall may lie.
double BackSlack(const SideHit& back, Vec3 d) {
  const double across = std::abs(CosineTo(back.normal, d)) * Length(d);
  return kSameWallMetres / std::max(across, 1e-6);
}

bool IsSameWall(const SideHit& back, const SideHit& front, Vec3 d) {
  const Vec3 n{front.normal[0], front.normal[1], front.normal[2]};
  return front.distance - back.distance <= BackSlack(back, d) &&
         std::abs(CosineTo(back.normal, n)) > kSameNormal;
}

TraceHit Resolve(const RayState& state, Vec3 d) {
  const bool is_front = state.front.distance <= state.back.distance ||
                        IsSameWall(state.back, state.front, d);
  const SideHit& side = is_front ? state.front : state.back;
  TraceHit hit;
  hit.hit = side.distance < kFar;
  if (hit.hit) {
    hit.distance = side.distance;
    hit.cell = side.cell;
    hit.patch = side.patch;
    hit.a = side.a;
    hit.b = side.b;
    hit.on_front = is_front;
  }
  return hit;
}

// Hit of Embree's that a filter has set aside.
struct RawHit {
  float distance = std::numeric_limits<float>::infinity();
  float u = 0, v = 0;
  std::array<float, 3> normal{};
  uint32_t geometry = RTC_INVALID_GEOMETRY_ID;
  uint32_t primitive = 0;
};

// What a query hands to its filter. Embree's struct comes first.
struct QueryContext {
  RTCIntersectContext embree{};
  RawHit back;
};

// Rejects hits on backs and keeps the nearest of them: the query goes on to
// the nearest front.
void KeepBacks(const RTCFilterFunctionNArguments* args) {
  ENFILADE_CHECK(args->N == 1, "rays come one by one, not {}", args->N);
  if (args->valid[0] == 0) {
    return;
  }
  const float nx = RTCHitN_Ng_x(args->hit, 1, 0);
  const float ny = RTCHitN_Ng_y(args->hit, 1, 0);
  const float nz = RTCHitN_Ng_z(args->hit, 1, 0);
  const float facing = nx * RTCRayN_dir_x(args->ray, 1, 0) +
                       ny * RTCRayN_dir_y(args->ray, 1, 0) +
                       nz * RTCRayN_dir_z(args->ray, 1, 0);
  if (facing <= 0) {
    return;
  }
  args->valid[0] = 0;
  // The context is the first member of a QueryContext.
  RawHit& back = reinterpret_cast<QueryContext*>(args->context)->back;
  const float distance = RTCRayN_tfar(args->ray, 1, 0);
  const auto geometry = RTCHitN_geomID(args->hit, 1, 0);
  const auto primitive = RTCHitN_primID(args->hit, 1, 0);
  if (std::tie(distance, geometry, primitive) <
      std::tie(back.distance, back.geometry, back.primitive)) {
    back = {distance,
            RTCHitN_u(args->hit, 1, 0),
            RTCHitN_v(args->hit, 1, 0),
            {nx, ny, nz},
            geometry,
            primitive};
  }
}

}  // namespace

// A chunk in memory. RayTracer::Impl holds it and is known elsewhere by name.
struct LoadedChunk {
  Point3 origin;
  std::unique_ptr<EmbreeScene> scene;
  std::array<std::vector<TracePrimitive>, 2> ids;  // by geometry
  MemoryCharge charge;

  [[nodiscard]] uint64_t Bytes() const {
    return scene->Bytes() + charge.Bytes();
  }
};

namespace {

// Merges a chunk's hit, `start` being the ray's distance to where the query
// began.
void Merge(const LoadedChunk& chunk,
           const RawHit& raw,
           double start,
           double max_distance,
           SideHit& side) {
  if (raw.geometry == RTC_INVALID_GEOMETRY_ID) {
    return;
  }
  const TracePrimitive id = chunk.ids[raw.geometry][raw.primitive];
  const SideHit candidate{
      start + raw.distance, id.cell, id.patch, raw.u, raw.v, raw.normal};
  if (candidate.distance <= max_distance && candidate.Order() < side.Order()) {
    side = candidate;
  }
}

// As far as the ray still has to look.
double Reach(const TraceRay& ray, const RayState& state) {
  double end = std::min(ray.max_distance, state.front.distance);
  if (state.back.distance < kFar) {
    end = std::min(end,
                   state.back.distance + BackSlack(state.back, ray.direction));
  }
  return end;
}

// Traces one ray in one chunk from distance `start` on.
void TraceInChunk(const LoadedChunk& chunk,
                  const TraceRay& ray,
                  double start,
                  RayState& state) {
  const Vec3 o = ray.origin + ray.direction * start - chunk.origin;
  RTCRayHit query{};
  query.ray.org_x = static_cast<float>(o.x);
  query.ray.org_y = static_cast<float>(o.y);
  query.ray.org_z = static_cast<float>(o.z);
  query.ray.dir_x = static_cast<float>(ray.direction.x);
  query.ray.dir_y = static_cast<float>(ray.direction.y);
  query.ray.dir_z = static_cast<float>(ray.direction.z);
  // A little farther than needed: rounding must not decide between chunks.
  const double length = Reach(ray, state) - start;
  query.ray.tfar = static_cast<float>(std::min(
      length * (1 + 1e-6) + kSlackMetres / Length(ray.direction), 1e30));
  query.ray.mask = ~0U;
  query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  QueryContext context;
  rtcInitIntersectContext(&context.embree);
  rtcIntersect1(chunk.scene->Handle(), &context.embree, &query);
  const RawHit front{query.ray.tfar,
                     query.hit.u,
                     query.hit.v,
                     {query.hit.Ng_x, query.hit.Ng_y, query.hit.Ng_z},
                     query.hit.geomID,
                     query.hit.primID};
  Merge(chunk, front, start, ray.max_distance, state.front);
  Merge(chunk, context.back, start, ray.max_distance, state.back);
}

// A ray prepared for tests against boxes.
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

  // Distance at which the ray enters the box, or kFar if after `end` or never.
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
    return kFar;
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
  std::vector<std::unique_ptr<LoadedChunk>> chunks;  // null: not in memory
  uint64_t loaded_bytes = 0;
};

bool RayTracer::Impl::IsWanted(size_t chunk,
                               std::span<const TraceRay> rays,
                               std::span<const RayState> states) const {
  for (size_t i = 0; i < rays.size(); ++i) {
    if (BoxRay(rays[i]).Enter(table[chunk].bounds, Reach(rays[i], states[i])) <
        kFar) {
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

// Evicts while the process itself comes near the cap: the allocator may keep
// more than is charged.
void RayTracer::Impl::HoldResident(const std::vector<size_t>& keep,
                                   uint64_t coming_bytes) {
  if (budget->ResidentExcess(coming_bytes) > 0) {
    ReleaseFreedMemory();
    const uint64_t excess = budget->ResidentExcess(coming_bytes);
    EvictAllBut(keep, loaded_bytes - std::min(loaded_bytes, excess));
  }
}

void RayTracer::Impl::Load(size_t chunk, const std::vector<size_t>& keep) {
  // Corners twice (read and in Embree), its tree and the ids.
  const uint64_t expected = table[chunk].primitives * 256;
  EvictAllBut(keep, share_bytes - std::min(share_bytes, expected));
  HoldResident(keep, expected);
  const MemoryCharge reading(
      *budget, table[chunk].primitives * 112, "reading triangles");
  TraceChunk content = LoadTraceChunk(*store, chunk);
  auto loaded = std::make_unique<LoadedChunk>();
  loaded->origin = content.origin;
  loaded->charge =
      MemoryCharge(*budget,
                   table[chunk].primitives * sizeof(TracePrimitive),
                   "patch numbers for ray tracing");
  loaded->scene = device->Build(
      content.quads, content.triangles, "a trace chunk", &KeepBacks);
  loaded->ids = {std::move(content.quad_ids), std::move(content.triangle_ids)};
  loaded_bytes += loaded->Bytes();
  chunks[chunk] = std::move(loaded);
}

// Takes from `remaining` the chunks to trace next: those in memory first, then
// as many as the share holds, at least one that a ray wants.
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
    const uint64_t expected = table[chunk].primitives * 160;
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

// From near to far, as long as nothing nearer was hit.
void RayTracer::Impl::TraceInGroup(std::span<const size_t> group,
                                   const TraceRay& ray,
                                   RayState& state) const {
  thread_local std::vector<std::pair<double, size_t>> entries;
  entries.clear();
  const BoxRay box_ray(ray);
  const double reach = Reach(ray, state);
  for (const size_t chunk : group) {
    const double enter = box_ray.Enter(table[chunk].bounds, reach);
    if (enter < kFar) {
      entries.emplace_back(enter, chunk);
    }
  }
  std::sort(entries.begin(), entries.end());
  for (const auto& [enter, chunk] : entries) {
    if (enter > Reach(ray, state)) {
      break;
    }
    TraceInChunk(*chunks[chunk], ray, enter, state);
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
