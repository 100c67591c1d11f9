// A trace chunk in memory. A LoadedChunk finds, for each ray, the nearest hit
// on a front (a side whose normal faces the ray) and the nearest hit on a back.
// A chunk's answer does not depend on what the ray met before, and the answers
// of chunks are combined by (distance, cell, patch).

#pragma once

#include "base/ids.h"
#include "base/memory.h"
#include "base/vec.h"
#include "visibility/embree.h"
#include "visibility/ray_tracer.h"
#include "visibility/trace_chunk.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <tuple>
#include <vector>

namespace enfilade {

// The distance of a ray that meets nothing.
inline constexpr double kNoHitDistance =
    std::numeric_limits<double>::infinity();

struct SideHit {
  double distance = kNoHitDistance;
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

// The distance up to which the ray still has to look.
double Reach(const TraceRay& ray, const RayState& state);

// The final hit of a ray in direction `d`. Where the two sides of one wall lie
// in one place, the hit is on the front.
TraceHit Resolve(const RayState& state, Vec3 d);

class LoadedChunk {
 public:
  // Charges the budget, also for the memory of reading.
  LoadedChunk(const BlockStorage& store,
              size_t chunk,
              size_t primitives,
              EmbreeDevice& device,
              MemoryBudget& budget);

  // The bytes that a chunk of so many primitives takes, about: LoadingBytes
  // while the chunk is read, HeldBytes afterwards.
  static uint64_t LoadingBytes(uint64_t primitives) { return primitives * 256; }

  static uint64_t HeldBytes(uint64_t primitives) { return primitives * 160; }

  [[nodiscard]] uint64_t Bytes() const {
    return scene_->Bytes() + charge_.Bytes();
  }

  // Traces a ray from distance `start` on. Thread-safe.
  void Trace(const TraceRay& ray, double start, RayState* state) const;

 private:
  Point3 origin_;
  std::unique_ptr<EmbreeScene> scene_;
  std::array<std::vector<TracePrimitive>, 2> ids_;  // by geometry
  MemoryCharge charge_;
};

}  // namespace enfilade
