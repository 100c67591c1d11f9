// Cleans polygons as exporters write them, in batches of one material and
// object: welds vertices, drops polygons without area and duplicates, joins
// coplanar neighbours and cuts the result into few convex pieces.

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
  uint64_t crossed = 0;       // of these: cross themselves, as bow ties
  uint64_t duplicates = 0;    // dropped: same vertices as one before
  uint64_t warped = 0;        // not planar: cut into triangles
  uint64_t joined = 0;        // given polygons that went into a region
  uint64_t regions = 0;       // regions of two or more polygons
  uint64_t non_manifold = 0;  // of the joined: at edges of no manifold
  uint64_t faces = 0;         // delivered

  // As sentences; empty if nothing was changed.
  [[nodiscard]] std::vector<std::string> Notes() const;
};

// What cleaning delivers.
struct CleanFace {
  std::span<const Point3> polygon;
  // The solid that it and others of the batch close off.
  std::optional<ClosedSolid> solid;
  double surface_m2 = 0;  // of all pieces of its region
};

// How a batch is cleaned.
struct CleaningOptions {
  // Whether the faces emit or have black backs. Then only neighbours of the
  // same orientation are joined, and of two back-to-back faces both stay.
  bool oriented = false;
  std::function<void(const CleanFace& face)> emit;  // receives each face
};

// Collects polygons and delivers convex planar faces. The same polygons in the
// same order give the same faces. Not thread-safe; borrows the budget.
class MeshCleaner {
 public:
  // The caller flushes a batch before it gets larger than this, so that the
  // pending polygons are bounded. Few batches have as many corners.
  static constexpr size_t kMostPolygons = 16384;
  static constexpr size_t kMostCorners = 16 * kMostPolygons;

  explicit MeshCleaner(MemoryBudget& budget) : budget_(&budget) {}

  // Takes a polygon of at least three finite vertices, roughly planar and of
  // any shape.
  void Add(std::span<const Point3> polygon);

  // Whether the batch has room for one more polygon of so many corners. The
  // first polygon of a batch may be of any size.
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
