// Measures the rate of Occluded() and that of bare rtcOccluded16 on the same
// segments in the same run. The difference is the cost of Enfilade's packing,
// shortening and culling. Also measures the rate of rtcOccluded16 on all cores
// together, which shows how much the other cores add.
//
//   bench_occlusion [boxes]

#include "visibility/occlusion.h"

#include "base/memory.h"
#include "base/random.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <thread>
#include <vector>

#include "tests/visibility/test_rooms.h"
#include <embree3/rtcore.h>

namespace enfilade {
namespace {

constexpr size_t kPackets = 60000;

CellPatches Furnished(int boxes) {
  CellPatches cell;
  cell.bounds = {{0, 0, 0}, {10, 10, 10}};
  cell.patches = test::BoxPatches(cell.bounds, true);
  Random random(1);
  for (int i = 0; i < boxes; ++i) {
    const Point3 low{9 * random.Next(), 9 * random.Next(), 9 * random.Next()};
    const Vec3 size{random.Next() / 4, random.Next() / 4, random.Next() / 4};
    test::Append(cell.patches, test::BoxPatches({low, low + size}, false));
  }
  return cell;
}

// The segments of a packet join one small area with another, as those of a
// link do.
std::vector<SegmentPacket> Segments() {
  std::vector<SegmentPacket> packets(kPackets);
  Random random(2);
  const auto next = [&] { return static_cast<float>(random.Next()); };
  for (SegmentPacket& p : packets) {
    p.count = 16;
    const float x0 = 9 * next();
    const float y0 = 9 * next();
    const float y1 = 9 * next();
    const float z1 = 9 * next();
    for (size_t i = 0; i < 16; ++i) {
      p.from_x[i] = x0 + 0.5F * next();
      p.from_y[i] = y0 + 0.5F * next();
      p.from_z[i] = 0;
      p.to_x[i] = 0;
      p.to_y[i] = y1 + 0.5F * next();
      p.to_z[i] = z1 + 0.5F * next();
    }
  }
  return packets;
}

RTCRay16 RawRays(const SegmentPacket& p) {
  RTCRay16 r{};
  for (size_t i = 0; i < 16; ++i) {
    r.org_x[i] = p.from_x[i];
    r.org_y[i] = p.from_y[i];
    r.org_z[i] = p.from_z[i];
    r.dir_x[i] = p.to_x[i] - p.from_x[i];
    r.dir_y[i] = p.to_y[i] - p.from_y[i];
    r.dir_z[i] = p.to_z[i] - p.from_z[i];
    r.tnear[i] = 1e-4F;
    r.tfar[i] = 1 - 1e-4F;
    r.mask[i] = ~0U;
  }
  return r;
}

RTCScene RawScene(RTCDevice device, const CellPatches& cell, bool quads) {
  RTCScene scene = rtcNewScene(device);
  rtcSetSceneFlags(scene, RTC_SCENE_FLAG_COMPACT | RTC_SCENE_FLAG_ROBUST);
  RTCGeometry g = rtcNewGeometry(
      device, quads ? RTC_GEOMETRY_TYPE_QUAD : RTC_GEOMETRY_TYPE_TRIANGLE);
  const size_t n = cell.patches.size();
  auto* v = static_cast<float*>(rtcSetNewGeometryBuffer(
      g, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 12, 4 * n));
  auto* f = static_cast<uint32_t*>(
      rtcSetNewGeometryBuffer(g,
                              RTC_BUFFER_TYPE_INDEX,
                              0,
                              quads ? RTC_FORMAT_UINT4 : RTC_FORMAT_UINT3,
                              quads ? 16 : 12,
                              quads ? n : 2 * n));
  for (size_t i = 0; i < n; ++i) {
    const Patch& p = cell.patches[i];
    for (const Point3 q :
         {p.origin, p.origin + p.u, p.origin + p.u + p.v, p.origin + p.v}) {
      *v++ = static_cast<float>(q.x);
      *v++ = static_cast<float>(q.y);
      *v++ = static_cast<float>(q.z);
    }
    const auto b = static_cast<uint32_t>(4 * i);
    const std::vector<uint32_t> corners =
        quads ? std::vector<uint32_t>{b, b + 1, b + 2, b + 3}
              : std::vector<uint32_t>{b, b + 1, b + 2, b, b + 2, b + 3};
    f = std::copy(corners.begin(), corners.end(), f);
  }
  rtcCommitGeometry(g);
  rtcAttachGeometry(scene, g);
  rtcReleaseGeometry(g);
  rtcCommitScene(scene);
  return scene;
}

template <typename Body>
double RaysPerSecond(const Body& body) {
  double best = 0;
  for (int repeat = 0; repeat < 5; ++repeat) {
    const auto start = std::chrono::steady_clock::now();
    body();
    const std::chrono::duration<double> t =
        std::chrono::steady_clock::now() - start;
    best = std::max(best, 16.0 * kPackets / t.count());
  }
  return best;
}

// Traces all packets once. Returns in how many the first ray is blocked.
uint64_t TraceRaw(RTCScene scene, std::vector<RTCRay16>& rays) {
  const std::vector<int> valid(16, -1);
  uint64_t blocked = 0;
  for (RTCRay16& r : rays) {
    RTCIntersectContext context{};
    rtcInitIntersectContext(&context);
    rtcOccluded16(valid.data(), scene, &context, &r);
    blocked += r.tfar[0] < 0 ? 1 : 0;
  }
  return blocked;
}

// Rays per second of `threads` threads together, each of which traces all
// packets.
double RawRate(RTCScene scene,
               const std::vector<SegmentPacket>& packets,
               size_t threads) {
  std::vector<std::vector<RTCRay16>> rays(
      threads, std::vector<RTCRay16>(packets.size()));
  std::atomic<uint64_t> blocked = 0;
  double best = 0;
  for (int repeat = 0; repeat < 5; ++repeat) {
    for (auto& own : rays) {
      std::transform(packets.begin(), packets.end(), own.begin(), RawRays);
    }
    const auto start = std::chrono::steady_clock::now();
    std::vector<std::thread> others;
    for (size_t i = 1; i < threads; ++i) {
      others.emplace_back([&, i] { blocked += TraceRaw(scene, rays[i]); });
    }
    blocked += TraceRaw(scene, rays[0]);
    for (std::thread& other : others) {
      other.join();
    }
    const std::chrono::duration<double> t =
        std::chrono::steady_clock::now() - start;
    best = std::max(best,
                    16.0 * kPackets * static_cast<double>(threads) / t.count());
  }
  std::printf("  (%.0f %% of first lanes blocked)\n",
              100.0 * static_cast<double>(blocked) /
                  (5.0 * kPackets * static_cast<double>(threads)));
  return best;
}

double OurRate(const std::vector<const RayBlockers*>& cells,
               const std::vector<SegmentPacket>& packets) {
  uint64_t sum = 0;
  const double rate = RaysPerSecond([&] {
    for (const SegmentPacket& p : packets) {
      sum += Occluded(cells, p);
    }
  });
  return sum == 0 ? 0 : rate;
}

void Run(int boxes) {
  const CellPatches cell = Furnished(boxes);
  const std::vector<SegmentPacket> packets = Segments();
  MemoryBudget budget(1ULL << 30);
  const OcclusionDevice device(budget, {});
  const auto blockers = device.Build(cell);
  RTCDevice raw = rtcNewDevice("max_isa=avx2");
  RTCScene quads = RawScene(raw, cell, true);
  RTCScene triangles = RawScene(raw, cell, false);
  const size_t cores = std::max(1U, std::thread::hardware_concurrency());
  const double raw_quads = RawRate(quads, packets, 1);
  const double raw_all = RawRate(quads, packets, cores);
  const double raw_triangles = RawRate(triangles, packets, 1);
  const double ours = OurRate({blockers.get()}, packets);
  std::printf("patches %zu, one thread, peak %.0f MiB\n",
              cell.patches.size(),
              static_cast<double>(PeakResidentBytes()) / (1 << 20));
  std::printf("bare rtcOccluded16, quads      %6.2f M rays/s\n",
              raw_quads / 1e6);
  std::printf(
      "all %zu cores together          %7.2f M rays/s\n", cores, raw_all / 1e6);
  std::printf("bare rtcOccluded16, triangles  %6.2f M rays/s\n",
              raw_triangles / 1e6);
  std::printf("Occluded                       %6.2f M rays/s, %.0f %%\n",
              ours / 1e6,
              100 * ours / raw_quads);
  std::printf("bytes per patch                %6.1f\n",
              static_cast<double>(BlockersBytes(*blockers)) /
                  static_cast<double>(cell.patches.size()));
  rtcReleaseScene(quads);
  rtcReleaseScene(triangles);
  rtcReleaseDevice(raw);
}

}  // namespace
}  // namespace enfilade

int main(int argc, char** argv) {
  enfilade::Run(argc > 1 ? std::atoi(argv[1]) : 1500);
  return 0;
}
