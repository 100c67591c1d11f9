// Occlusion queries within the few cells of a subproblem. Each cell has an
// Embree scene of its own, which the caller builds when it is needed, caches by
// its bytes and evicts.

#pragma once

#include "base/ids.h"
#include "base/memory.h"
#include "base/vec.h"
#include "partition/patch.h"

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace enfilade {

// Up to 16 segments, structure of arrays, in coordinates relative to the
// OcclusionDevice's origin. Only what lies strictly between the ends of a
// segment blocks it. The members are left uninitialised, because packets are
// made by the million and lanes from `count` on are never read.
// NOLINTNEXTLINE(cppcoreguidelines-pro-type-member-init)
struct SegmentPacket {
  alignas(64) std::array<float, 16> from_x, from_y, from_z;
  alignas(64) std::array<float, 16> to_x, to_y, to_z;
  uint32_t count = 0;
};

// The blockers of one cell, immutable after building. Thread-safe queries.
class RayBlockers;

// Embree's device: one per process. Counts Embree's memory against the budget
// (rtcSetDeviceMemoryMonitorFunction); a build that does not fit throws
// DoesNotFitError and leaves the device usable.
class OcclusionDevice {
 public:
  // World coordinates are taken relative to `origin` before they are rounded to
  // float.
  OcclusionDevice(MemoryBudget& budget, Point3 origin);
  ~OcclusionDevice();
  OcclusionDevice(const OcclusionDevice&) = delete;
  OcclusionDevice& operator=(const OcclusionDevice&) = delete;

  [[nodiscard]] std::shared_ptr<const RayBlockers> Build(
      const CellPatches& cell) const;

  [[nodiscard]] Point3 Origin() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

// How many of a cell's patches are blockers. A patch and its twin are one.
size_t BlockerCount(const CellPatches& cell);

// Upper bounds, measured, of the bytes that so many blockers hold, and of the
// bytes that they take at the peak of building.
uint64_t BlockersHeldBytes(size_t blockers);
uint64_t BlockersBuildBytes(size_t blockers);

// Bytes that the blockers hold, Embree's share included.
uint64_t BlockersBytes(const RayBlockers& blockers);

// Bit i of the result says whether any of the blockers blocks segment i.
// Segments are shortened a little at both ends so that the surfaces they start
// and end on do not block them.
uint32_t Occluded(std::span<const RayBlockers* const> blockers,
                  const SegmentPacket& packet);

// Rays traced by Occluded so far in this process.
uint64_t TracedRays();

}  // namespace enfilade
