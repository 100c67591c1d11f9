// Occlusion queries within the few cells of a subproblem: one Embree scene per
// cell, built when needed, cached by bytes, evicted when the budget wants it.

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
// OcclusionDevice's origin. Only what lies strictly between the ends blocks.
// Left uninitialised: packets are made by the million and lanes from `count` on
// are never read.
// NOLINTNEXTLINE(cppcoreguidelines-pro-type-member-init)
struct SegmentPacket {
  alignas(64) std::array<float, 16> from_x, from_y, from_z;
  alignas(64) std::array<float, 16> to_x, to_y, to_z;
  uint32_t count = 0;
};

// The blockers of one cell, immutable after building. Thread-safe queries.
class CellBlockers;

// Embree's device: one per process. Counts Embree's memory against the budget
// (rtcSetDeviceMemoryMonitorFunction); a build that does not fit throws
// DoesNotFitError and leaves the device usable.
class OcclusionDevice {
 public:
  // `origin`: world coordinates are taken relative to it before rounding to
  // float.
  OcclusionDevice(MemoryBudget& budget, Point3 origin);
  ~OcclusionDevice();
  OcclusionDevice(const OcclusionDevice&) = delete;
  OcclusionDevice& operator=(const OcclusionDevice&) = delete;

  [[nodiscard]] std::shared_ptr<const CellBlockers> Build(
      const CellPatches& cell) const;

  [[nodiscard]] Point3 Origin() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

// How many of a cell's patches are blockers: twins are one.
size_t BlockerCount(const CellPatches& cell);

// Upper bounds, measured, of what so many blockers hold, and of what they take
// at the peak of their building.
uint64_t BlockersHeldBytes(size_t blockers);
uint64_t BlockersBuildBytes(size_t blockers);

// Bytes that the blockers hold, Embree's share included.
uint64_t BlockersBytes(const CellBlockers& blockers);

// Bit i of the result: segment i is blocked by any of the blockers. Segments
// are shortened a little at both ends so that the surfaces they start and end
// on do not block them.
uint32_t Occluded(std::span<const CellBlockers* const> blockers,
                  const SegmentPacket& packet);

// Rays traced by Occluded so far in this process.
uint64_t TracedRays();

}  // namespace enfilade
