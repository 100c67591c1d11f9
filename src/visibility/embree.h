// Owners of Embree's device and scenes. Embree's memory is charged to the
// budget. Internal to src/visibility.

#pragma once

#include "base/memory.h"
#include "base/packed.h"
#include "base/vec.h"

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <span>

#include <embree3/rtcore.h>

namespace enfilade {

// A vertex in the float coordinates of some local origin.
struct LocalPoint {
  float x = 0, y = 0, z = 0;
};

template <>
inline constexpr bool kIsPacked<LocalPoint> = sizeof(LocalPoint) ==
                                              3 * sizeof(float);

// The bytes that a primitive takes while a scene is built. Measured: 115 to 194
// at the peak (docs/decisions/least-memory.md).
inline constexpr uint64_t kBuildBytesPerBlocker = 200;

// The corners origin, origin + u, (origin + u + v,) origin + v: Embree's hit
// coordinates (u, v) are then the patch coordinates (a, b).
using LocalQuad = std::array<LocalPoint, 4>;
using LocalTriangle = std::array<LocalPoint, 3>;

class EmbreeScene;

// A device whose allocations are charged to the budget. Thread-safe.
class EmbreeDevice : public std::enable_shared_from_this<EmbreeDevice> {
 public:
  static std::shared_ptr<EmbreeDevice> Create(MemoryBudget& budget);
  ~EmbreeDevice();
  EmbreeDevice(const EmbreeDevice&) = delete;
  EmbreeDevice& operator=(const EmbreeDevice&) = delete;

  // Builds a scene in which geometry 0 holds the quads and geometry 1 the
  // triangles, with primitives in the order given. Builds on the calling thread
  // alone. `filter`, if any, sees every hit of closest-hit queries. If the
  // budget cannot take the scene, throws DoesNotFitError, which names `what`;
  // the device stays usable and nothing stays charged.
  [[nodiscard]] std::unique_ptr<EmbreeScene> Build(
      std::span<const LocalQuad> quads,
      std::span<const LocalTriangle> triangles,
      const char* what,
      RTCFilterFunctionN filter = nullptr);

 private:
  explicit EmbreeDevice(MemoryBudget& budget);
  static bool OnMemory(void* self, ssize_t bytes, bool post);

  MemoryBudget* budget_;
  RTCDevice device_;
};

// An immutable scene. Queries are thread-safe.
class EmbreeScene {
 public:
  EmbreeScene(std::shared_ptr<EmbreeDevice> device, RTCScene scene)
      : device_(std::move(device)), scene_(scene) {}

  ~EmbreeScene();
  EmbreeScene(const EmbreeScene&) = delete;
  EmbreeScene& operator=(const EmbreeScene&) = delete;

  [[nodiscard]] RTCScene Handle() const { return scene_; }

  // The bytes that Embree allocated for the scene and still holds.
  [[nodiscard]] uint64_t Bytes() const { return bytes_; }

 private:
  friend class EmbreeDevice;

  std::shared_ptr<EmbreeDevice> device_;
  RTCScene scene_;
  uint64_t bytes_ = 0;
};

}  // namespace enfilade
