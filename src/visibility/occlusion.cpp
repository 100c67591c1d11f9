#include "visibility/occlusion.h"

#include "base/check.h"
#include "partition/patch_points.h"
#include "visibility/embree.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <thread>

#include <embree3/rtcore.h>

namespace enfilade {

class RayBlockers {
 public:
  std::unique_ptr<EmbreeScene> scene;  // null if nothing blocks
  std::array<float, 3> low{}, high{};  // bounds of the blockers
};

struct OcclusionDevice::Impl {
  Impl(MemoryBudget& budget, Point3 origin_in)
      : device(EmbreeDevice::Create(budget)), origin(origin_in) {}

  std::shared_ptr<EmbreeDevice> device;
  Point3 origin;
};

namespace {

constexpr size_t kLanes = 16;

// The memory of Embree's scenes, measured (docs/decisions/least-memory.md):
// cells of 100 patches and more held 83 to 140 bytes per blocker; small cells
// held a few KiB more.
constexpr uint64_t kSceneBytes = 16 << 10;
constexpr uint64_t kHeldBytesPerBlocker = 140;

// Segments are shortened at both ends by kEndMeters + kEndFraction * length.
// Rounding to float moves an end off its surface by at most 2^-24 of its
// coordinate: 4e-6 m at 64 m from the origin. A tenth of a millimetre then lets
// all segments pass that leave their surface steeper than 1 in 25. From 420 m
// on, kEndOfCoordinate takes the place of kEndMeters. The fraction
// covers the error of the distance that Embree computes in float. The fraction
// is small, so that a surface that hides another from near by also hides it
// from afar.
constexpr float kEndMeters = 1e-4F;
constexpr float kEndFraction = 2e-6F;
constexpr float kEndOfCoordinate = 4.0F / (1 << 24);

// Counts rays in counters that threads seldom share.
struct alignas(64) RayCounter {
  std::atomic<uint64_t> rays{0};
};

constexpr size_t kRayCounters = 64;

std::array<RayCounter, kRayCounters>& RayCounters() {
  static std::array<RayCounter, kRayCounters> counters;
  return counters;
}

void CountRays(uint64_t rays) {
  thread_local const size_t mine =
      std::hash<std::thread::id>{}(std::this_thread::get_id()) % kRayCounters;
  RayCounters()[mine].rays.fetch_add(rays, std::memory_order_relaxed);
}

LocalPoint Local(Point3 p, Point3 origin) {
  const Vec3 d = p - origin;
  return {static_cast<float>(d.x),
          static_cast<float>(d.y),
          static_cast<float>(d.z)};
}

// Embree's packet of n rays and the query that traces it. Packets of few
// segments are traced as narrow ones, because Embree traces the few lanes of a
// packet of 16 one by one, at two to three times the cost per ray.
template <size_t n>
struct Query;

template <>
struct Query<4> {
  using Rays = RTCRay4;
  static constexpr auto kTrace = &rtcOccluded4;
};

template <>
struct Query<8> {
  using Rays = RTCRay8;
  static constexpr auto kTrace = &rtcOccluded8;
};

template <>
struct Query<16> {
  using Rays = RTCRay16;
  static constexpr auto kTrace = &rtcOccluded16;
};

// Copies the first n lanes. Lanes from `count` on repeat lane 0, because Embree
// asserts that all lanes are finite.
template <size_t n>
void CopyLanes(const std::array<float, kLanes>& from,
               uint32_t count,
               float* to) {
  if (count == n) {
    std::copy_n(from.begin(), n, to);
    return;
  }
  for (size_t i = 0; i < n; ++i) {
    to[i] = from[i < count ? i : 0];
  }
}

// The ends of n segments.
// NOLINTNEXTLINE(cppcoreguidelines-pro-type-member-init): filled by MakeRays
template <size_t n>
struct Ends {
  alignas(4 * n) std::array<float, n> x, y, z;
};

// Makes Embree's rays of the segments, with unnormalised directions and t in
// [0,1]. `valid` is -1 for lanes to trace.
template <size_t n>
void MakeRays(const SegmentPacket& packet,
              typename Query<n>::Rays& rays,
              Ends<n>& to,
              int* valid) {
  CopyLanes<n>(packet.from_x, packet.count, rays.org_x);
  CopyLanes<n>(packet.from_y, packet.count, rays.org_y);
  CopyLanes<n>(packet.from_z, packet.count, rays.org_z);
  CopyLanes<n>(packet.to_x, packet.count, to.x.data());
  CopyLanes<n>(packet.to_y, packet.count, to.y.data());
  CopyLanes<n>(packet.to_z, packet.count, to.z.data());
  const auto count = static_cast<int>(packet.count);
  for (size_t i = 0; i < n; ++i) {
    const float dx = to.x[i] - rays.org_x[i];
    const float dy = to.y[i] - rays.org_y[i];
    const float dz = to.z[i] - rays.org_z[i];
    const float length = std::sqrt(dx * dx + dy * dy + dz * dz);
    const float farthest = std::max({std::abs(rays.org_x[i]),
                                     std::abs(rays.org_y[i]),
                                     std::abs(rays.org_z[i])});
    const float end = std::max(kEndMeters, kEndOfCoordinate * farthest);
    const float near =
        std::min(kEndFraction + end / std::max(length, 1e-20F), 0.5F);
    rays.dir_x[i] = dx;
    rays.dir_y[i] = dy;
    rays.dir_z[i] = dz;
    rays.tnear[i] = near;
    rays.tfar[i] = 1.0F - near;
    rays.time[i] = 0;
    rays.mask[i] = ~0U;
    rays.id[i] = 0;
    rays.flags[i] = 0;
    valid[i] = static_cast<int>(i) < count && near < 0.5F ? -1 : 0;
  }
}

struct PacketBox {
  std::array<float, 3> low, high;
};

// The range of 2 n values, computed four at a time.
template <size_t n>
void IncludeAxis(const float* from,
                 const std::array<float, n>& to,
                 float& low,
                 float& high) {
  std::array<float, 4> least{INFINITY, INFINITY, INFINITY, INFINITY};
  std::array<float, 4> most{-INFINITY, -INFINITY, -INFINITY, -INFINITY};
  for (size_t i = 0; i < n; i += 4) {
    for (size_t k = 0; k < 4; ++k) {
      least[k] = std::min(least[k], std::min(from[i + k], to[i + k]));
      most[k] = std::max(most[k], std::max(from[i + k], to[i + k]));
    }
  }
  low = std::min(std::min(least[0], least[1]), std::min(least[2], least[3]));
  high = std::max(std::max(most[0], most[1]), std::max(most[2], most[3]));
}

template <size_t n>
PacketBox BoxOf(const typename Query<n>::Rays& rays, const Ends<n>& to) {
  PacketBox box{};
  IncludeAxis<n>(rays.org_x, to.x, box.low[0], box.high[0]);
  IncludeAxis<n>(rays.org_y, to.y, box.low[1], box.high[1]);
  IncludeAxis<n>(rays.org_z, to.z, box.low[2], box.high[2]);
  return box;
}

bool Misses(const PacketBox& box, const RayBlockers& cell) {
  for (size_t k = 0; k < 3; ++k) {
    if (box.low[k] > cell.high[k] || box.high[k] < cell.low[k]) {
      return true;
    }
  }
  return false;
}

// Occluded for packets of up to n segments.
template <size_t n>
uint32_t OccludedLanes(std::span<const RayBlockers* const> blockers,
                       const SegmentPacket& packet) {
  // The code below fills these; clearing them first would cost a few percent.
  // NOLINTBEGIN(cppcoreguidelines-pro-type-member-init)
  typename Query<n>::Rays rays;
  Ends<n> to;
  alignas(64) std::array<int, n> valid;
  MakeRays<n>(packet, rays, to, valid.data());
  const PacketBox box = BoxOf<n>(rays, to);
  RTCIntersectContext context;
  // NOLINTEND(cppcoreguidelines-pro-type-member-init)
  rtcInitIntersectContext(&context);
  uint32_t blocked = 0;
  for (const RayBlockers* cell : blockers) {
    if (cell->scene == nullptr || Misses(box, *cell)) {
      continue;
    }
    Query<n>::kTrace(valid.data(), cell->scene->Handle(), &context, &rays);
    uint32_t open = 0;
    for (size_t i = 0; i < n; ++i) {
      const bool hit = valid[i] != 0 && rays.tfar[i] < 0;
      blocked |= static_cast<uint32_t>(hit) << i;
      valid[i] = hit ? 0 : valid[i];
      open |= static_cast<uint32_t>(valid[i] != 0);
    }
    if (open == 0) {
      break;
    }
  }
  return blocked;
}

}  // namespace

OcclusionDevice::OcclusionDevice(MemoryBudget& budget, Point3 origin)
    : impl_(std::make_unique<Impl>(budget, origin)) {}

OcclusionDevice::~OcclusionDevice() = default;

Point3 OcclusionDevice::Origin() const {
  return impl_->origin;
}

std::shared_ptr<const RayBlockers> OcclusionDevice::Build(
    const CellPatches& cell) const {
  std::vector<LocalQuad> quads;
  std::vector<LocalTriangle> triangles;
  for (const Patch& p : cell.patches) {
    if (p.is_twin) {
      continue;
    }
    const CornerList<Point3> corners = CornersOf(p);
    const auto at = [&](size_t k) {
      return Local(corners.points.at(k), impl_->origin);
    };
    if (p.shape == PatchShape::kTriangle) {
      triangles.push_back({at(0), at(1), at(2)});
    } else {
      quads.push_back({at(0), at(1), at(2), at(3)});
    }
  }
  auto blockers = std::make_shared<RayBlockers>();
  if (quads.empty() && triangles.empty()) {
    return blockers;
  }
  blockers->scene = impl_->device->Build(quads, triangles, "a cell");
  RTCBounds bounds{};
  rtcGetSceneBounds(blockers->scene->Handle(), &bounds);
  blockers->low = {bounds.lower_x, bounds.lower_y, bounds.lower_z};
  blockers->high = {bounds.upper_x, bounds.upper_y, bounds.upper_z};
  return blockers;
}

size_t BlockerCount(const CellPatches& cell) {
  return static_cast<size_t>(std::count_if(
      cell.patches.begin(), cell.patches.end(), [](const Patch& p) {
        return !p.is_twin;
      }));
}

uint64_t BlockersHeldBytes(size_t blockers) {
  return kSceneBytes + blockers * kHeldBytesPerBlocker;
}

uint64_t BlockersBuildBytes(size_t blockers) {
  return kSceneBytes + blockers * kBuildBytesPerBlocker;
}

uint64_t BlockersBytes(const RayBlockers& blockers) {
  return sizeof(RayBlockers) +
         (blockers.scene == nullptr ? 0 : blockers.scene->Bytes());
}

uint32_t Occluded(std::span<const RayBlockers* const> blockers,
                  const SegmentPacket& packet) {
  ENFILADE_CHECK(packet.count <= kLanes, "{} segments", packet.count);
  if (packet.count == 0) {
    return 0;
  }
  CountRays(packet.count);
  if (packet.count <= 4) {
    return OccludedLanes<4>(blockers, packet);
  }
  return packet.count <= 8 ? OccludedLanes<8>(blockers, packet)
                           : OccludedLanes<16>(blockers, packet);
}

uint64_t TracedRays() {
  uint64_t sum = 0;
  for (const RayCounter& counter : RayCounters()) {
    sum += counter.rays.load(std::memory_order_relaxed);
  }
  return sum;
}

}  // namespace enfilade
