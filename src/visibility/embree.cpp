#include "visibility/embree.h"

#include "base/check.h"
#include "base/error.h"
#include "base/parallel.h"

#include <algorithm>
#include <exception>
#include <new>

#include <fmt/format.h>

namespace enfilade {
namespace {

// The bytes that Embree allocated less those it freed on this thread. A scene
// is built on one thread, so the difference over a build is what the scene
// holds.
int64_t& ThreadBytes() {
  thread_local int64_t bytes = 0;
  return bytes;
}

static_assert(sizeof(LocalPoint) == 12, "vertices are packed for Embree");

template <size_t kCorners>
void Attach(RTCDevice device,
            RTCScene scene,
            RTCGeometryType type,
            std::span<const std::array<LocalPoint, kCorners>> primitives,
            RTCFilterFunctionN filter) {
  if (primitives.empty()) {
    return;
  }
  RTCGeometry geometry = rtcNewGeometry(device, type);
  const size_t count = primitives.size();
  auto* vertices =
      static_cast<LocalPoint*>(rtcSetNewGeometryBuffer(geometry,
                                                       RTC_BUFFER_TYPE_VERTEX,
                                                       0,
                                                       RTC_FORMAT_FLOAT3,
                                                       sizeof(LocalPoint),
                                                       count * kCorners));
  auto* indices = static_cast<uint32_t*>(rtcSetNewGeometryBuffer(
      geometry,
      RTC_BUFFER_TYPE_INDEX,
      0,
      kCorners == 4 ? RTC_FORMAT_UINT4 : RTC_FORMAT_UINT3,
      kCorners * sizeof(uint32_t),
      count));
  if (vertices != nullptr &&
      indices != nullptr) {  // otherwise the memory is refused
    for (size_t i = 0; i < count; ++i) {
      for (size_t k = 0; k < kCorners; ++k) {
        vertices[i * kCorners + k] = primitives[i][k];
        indices[i * kCorners + k] = static_cast<uint32_t>(i * kCorners + k);
      }
    }
    if (filter != nullptr) {
      rtcSetGeometryIntersectFilterFunction(geometry, filter);
    }
    rtcCommitGeometry(geometry);
    rtcAttachGeometryByID(scene, geometry, kCorners == 4 ? 0 : 1);
  }
  rtcReleaseGeometry(geometry);
}

}  // namespace

std::shared_ptr<EmbreeDevice> EmbreeDevice::Create(MemoryBudget& budget) {
  return std::shared_ptr<EmbreeDevice>(new EmbreeDevice(budget));
}

// max_isa=avx2: with AVX-512, rtcOccluded16 of Embree 3.13.5 can hang in a
// compact robust scene. No thread count is given, because Embree would impose
// it on the whole process.
EmbreeDevice::EmbreeDevice(MemoryBudget& budget)
    : budget_(&budget), device_(rtcNewDevice("max_isa=avx2")) {
  if (device_ == nullptr) {
    const RTCError error = rtcGetDeviceError(nullptr);
    if (error == RTC_ERROR_OUT_OF_MEMORY) {
      throw std::bad_alloc();
    }
    if (error == RTC_ERROR_UNSUPPORTED_CPU) {
      throw Error(ExitCode::kUsage,
                  "this processor lacks instructions that tracing rays needs "
                  "(SSE2 at least); use another machine");
    }
    ENFILADE_CHECK(false,
                   "Embree error {} on opening its device",
                   static_cast<int>(error));
  }
  rtcSetDeviceMemoryMonitorFunction(device_, &EmbreeDevice::OnMemory, this);
}

EmbreeDevice::~EmbreeDevice() {
  rtcReleaseDevice(device_);
}

// A refusal (false) makes Embree give the build up and free what it was
// granted.
bool EmbreeDevice::OnMemory(void* self, ssize_t bytes, bool /*post*/) {
  MemoryBudget& budget = *static_cast<EmbreeDevice*>(self)->budget_;
  if (bytes > 0 && !budget.TryCharge(static_cast<uint64_t>(bytes))) {
    return false;
  }
  if (bytes < 0) {
    budget.Release(static_cast<uint64_t>(-bytes));
  }
  ThreadBytes() += bytes;
  return true;
}

std::unique_ptr<EmbreeScene> EmbreeDevice::Build(
    std::span<const LocalQuad> quads,
    std::span<const LocalTriangle> triangles,
    const char* what,
    RTCFilterFunctionN filter) {
  const int64_t bytes_before = ThreadBytes();
  rtcGetDeviceError(device_);  // clears an earlier error
  auto scene =
      std::make_unique<EmbreeScene>(shared_from_this(), rtcNewScene(device_));
  RTCScene handle = scene->Handle();
  rtcSetSceneFlags(handle, RTC_SCENE_FLAG_COMPACT | RTC_SCENE_FLAG_ROBUST);
  rtcSetSceneBuildQuality(handle, RTC_BUILD_QUALITY_MEDIUM);
  RTCError error = RTC_ERROR_NONE;
  RunAlone([&] {
    Attach(device_, handle, RTC_GEOMETRY_TYPE_QUAD, quads, filter);
    Attach(device_, handle, RTC_GEOMETRY_TYPE_TRIANGLE, triangles, filter);
    error = rtcGetDeviceError(device_);
    if (error == RTC_ERROR_NONE) {
      rtcCommitScene(handle);
      error = rtcGetDeviceError(device_);
    }
  });
  if (error == RTC_ERROR_OUT_OF_MEMORY) {
    // This charge throws an error that names a sufficient cap, unless it fits.
    const MemoryCharge asked(
        *budget_,
        kBuildBytesPerBlocker * (quads.size() + triangles.size()),
        fmt::format("the ray-tracing structure of {}", what));
    throw DoesNotFitError(fmt::format(
        "no room for the ray-tracing structure of {}; run again with a larger "
        "--memory",
        what));
  }
  ENFILADE_CHECK(error == RTC_ERROR_NONE,
                 "Embree error {} while building {}",
                 static_cast<int>(error),
                 what);
  scene->bytes_ =
      static_cast<uint64_t>(std::max<int64_t>(0, ThreadBytes() - bytes_before));
  return scene;
}

EmbreeScene::~EmbreeScene() {
  rtcReleaseScene(scene_);
}

}  // namespace enfilade
