#include "visibility/loaded_chunk.h"

#include "base/check.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <embree3/rtcore.h>

namespace enfilade {
namespace {

// The two sides of one wall are at most this far apart along their normal,
// because their vertices were rounded separately (trace_chunk.h).
constexpr double kSameWallMetres = 5e-5;
constexpr double kSameNormal = 0.999;

// A generous bound on the error of a distance in a chunk.
constexpr double kSlackMetres = 1e-5;

double CosineTo(const std::array<float, 3>& n, Vec3 d) {
  const Vec3 normal{n[0], n[1], n[2]};
  return Dot(normal, d) / (Length(normal) * Length(d));
}

// The distance, in lengths of d, that the front of a wall may lie beyond its
// back.
double BackSlack(const SideHit& back, Vec3 d) {
  const double across = std::abs(CosineTo(back.normal, d)) * Length(d);
  return kSameWallMetres / std::max(across, 1e-6);
}

bool IsSameWall(const SideHit& back, const SideHit& front, Vec3 d) {
  const Vec3 n{front.normal[0], front.normal[1], front.normal[2]};
  return front.distance - back.distance <= BackSlack(back, d) &&
         std::abs(CosineTo(back.normal, n)) > kSameNormal;
}

// A hit as Embree reports it.
struct RawHit {
  float distance = std::numeric_limits<float>::infinity();
  float u = 0, v = 0;
  std::array<float, 3> normal{};
  uint32_t geometry = RTC_INVALID_GEOMETRY_ID;
  uint32_t primitive = 0;
};

// The data that a query hands to its filter. Embree's struct comes first.
struct QueryContext {
  RTCIntersectContext embree{};
  RawHit back;
};

// Rejects hits on backs, so that the query goes on to the nearest front, and
// keeps the nearest hit on a back.
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

// Replaces `side` by the hit if the hit is nearer. `start` is the ray's
// distance to where the query began.
void Merge(const std::array<std::vector<TracePrimitive>, 2>& ids,
           const RawHit& raw,
           double start,
           double max_distance,
           SideHit& side) {
  if (raw.geometry == RTC_INVALID_GEOMETRY_ID) {
    return;
  }
  const TracePrimitive id = ids[raw.geometry][raw.primitive];
  const SideHit candidate{
      start + raw.distance, id.cell, id.patch, raw.u, raw.v, raw.normal};
  if (candidate.distance <= max_distance && candidate.Order() < side.Order()) {
    side = candidate;
  }
}

}  // namespace

double Reach(const TraceRay& ray, const RayState& state) {
  double end = std::min(ray.max_distance, state.front.distance);
  if (state.back.distance < kNoHitDistance) {
    end = std::min(end,
                   state.back.distance + BackSlack(state.back, ray.direction));
  }
  return end;
}

TraceHit Resolve(const RayState& state, Vec3 d) {
  const bool is_front = state.front.distance <= state.back.distance ||
                        IsSameWall(state.back, state.front, d);
  const SideHit& side = is_front ? state.front : state.back;
  TraceHit hit;
  hit.hit = side.distance < kNoHitDistance;
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

LoadedChunk::LoadedChunk(const BlockStorage& store,
                         size_t chunk,
                         size_t primitives,
                         EmbreeDevice& device,
                         MemoryBudget& budget) {
  const MemoryCharge reading(budget, primitives * 112, "reading triangles");
  TraceChunk content = LoadTraceChunk(store, chunk);
  origin_ = content.origin;
  charge_ = MemoryCharge(budget,
                         primitives * sizeof(TracePrimitive),
                         "patch numbers for ray tracing");
  scene_ = device.Build(
      content.quads, content.triangles, "a trace chunk", &KeepBacks);
  ids_ = {std::move(content.quad_ids), std::move(content.triangle_ids)};
}

void LoadedChunk::Trace(const TraceRay& ray,
                        double start,
                        RayState* state) const {
  const Vec3 o = ray.origin + ray.direction * start - origin_;
  RTCRayHit query{};
  query.ray.org_x = static_cast<float>(o.x);
  query.ray.org_y = static_cast<float>(o.y);
  query.ray.org_z = static_cast<float>(o.z);
  query.ray.dir_x = static_cast<float>(ray.direction.x);
  query.ray.dir_y = static_cast<float>(ray.direction.y);
  query.ray.dir_z = static_cast<float>(ray.direction.z);
  // Traces a little farther than needed, so that rounding does not decide
  // between chunks.
  const double length = Reach(ray, *state) - start;
  query.ray.tfar = static_cast<float>(std::min(
      length * (1 + 1e-6) + kSlackMetres / Length(ray.direction), 1e30));
  query.ray.mask = ~0U;
  query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  QueryContext context;
  rtcInitIntersectContext(&context.embree);
  rtcIntersect1(scene_->Handle(), &context.embree, &query);
  const RawHit front{query.ray.tfar,
                     query.hit.u,
                     query.hit.v,
                     {query.hit.Ng_x, query.hit.Ng_y, query.hit.Ng_z},
                     query.hit.geomID,
                     query.hit.primID};
  Merge(ids_, front, start, ray.max_distance, state->front);
  Merge(ids_, context.back, start, ray.max_distance, state->back);
}

}  // namespace enfilade
