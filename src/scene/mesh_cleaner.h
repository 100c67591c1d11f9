// Cleaning of polygons as exporters write them, a batch of one material and
// object at a time: weld, drop what has no area or is there twice, join
// coplanar neighbours and cut the result into few convex pieces.

#pragma once

#include "base/memory.h"
#include "base/vec.h"
#include "scene/face.h"

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace enfilade {

// What cleaning did, added up over the batches.
struct CleaningCounts {
  uint64_t polygons = 0;      // given
  uint64_t zero_area = 0;     // dropped: thinner than the weld distance
  uint64_t duplicates = 0;    // dropped: same vertices, either way round
  uint64_t warped = 0;        // not planar: cut into triangles
  uint64_t joined = 0;        // given polygons that went into a region
  uint64_t regions = 0;       // regions of two or more of them
  uint64_t non_manifold = 0;  // of those, refused by a sheet's manifold
  uint64_t faces = 0;         // delivered

  // As sentences; empty if nothing was changed.
  [[nodiscard]] std::vector<std::string> Notes() const;
};

// How a batch is cleaned.
struct CleaningOptions {
  // The faces are oriented: they emit, or their backs are black. Then only
  // neighbours of one orientation are joined and back-to-back faces both stay.
  bool oriented = false;
  // Gets a polygon, and the solid that it and others of the batch close off.
  std::function<void(std::span<const Point3> polygon,
                     const std::optional<ClosedSolid>& solid)>
      emit;
};

// Collects polygons and delivers convex planar faces. Not thread-safe; borrows
// the budget. The same polygons in the same order give the same faces.
class MeshCleaner {
 public:
  // Batches are flushed by the caller before they get larger than this, so
  // that what is pending is bounded: few have as many corners.
  static constexpr size_t kMostPolygons = 16384;
  static constexpr size_t kMostCorners = 16 * kMostPolygons;

  explicit MeshCleaner(MemoryBudget& budget) : budget_(&budget) {}

  // At least three finite vertices, any shape that is roughly planar.
  void Add(std::span<const Point3> polygon);

  // Whether the batch takes one more polygon, of so many corners; the first
  // may be of any size.
  [[nodiscard]] bool HasRoomFor(size_t corners) const;

  // Cleans and delivers what was added.
  void Flush(const CleaningOptions& options);

  [[nodiscard]] const CleaningCounts& Counts() const { return counts_; }

 private:
  MemoryBudget* budget_;
  std::vector<Point3> corners_;  // of all pending polygons
  std::vector<size_t> ends_;     // end of each polygon in corners_
  CleaningCounts counts_;
};

}  // namespace enfilade
