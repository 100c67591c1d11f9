// Indices of things in a plane: boxes around a point, coincident points,
// segments along an edge.

#pragma once

#include "solver/solution/coplanar.h"

#include <array>
#include <cstdint>
#include <span>
#include <unordered_map>
#include <vector>

namespace enfilade {

// Finds things in the plane by their bounding boxes.
class PlaneIndex {
 public:
  struct Box {
    PlanePoint low{1e300, 1e300};
    PlanePoint high{-1e300, -1e300};

    void Include(PlanePoint p);
  };

  // Each box has its place in `boxes` as its index; `margin_m` is added on all
  // sides.
  PlaneIndex(std::span<const Box> boxes, double margin_m);

  // Indices, in ascending order, of a superset of the boxes that contain `p`.
  // The span is valid as long as this index lives.
  [[nodiscard]] std::span<const uint32_t> Near(PlanePoint p) const;

  [[nodiscard]] uint64_t SizeBytes() const {
    return 4 * (starts_.capacity() + items_.capacity());
  }

 private:
  [[nodiscard]] std::array<size_t, 2> SlotOf(PlanePoint p) const;

  Box bounds_;
  size_t columns_ = 1;
  size_t rows_ = 1;
  std::vector<uint32_t> starts_;  // [row * columns + column], and the end
  std::vector<uint32_t> items_;
};

// Gives points that are closer to each other than a tolerance the same number.
class PointWelder {
 public:
  explicit PointWelder(double tolerance_m);

  // The number of an earlier point within the tolerance of `p`, else the next
  // number.
  uint32_t Add(PlanePoint p);

  [[nodiscard]] const std::vector<PlanePoint>& Points() const {
    return points_;
  }

  // The bytes that the welder takes per point.
  static constexpr uint64_t kPointBytes = 96;

 private:
  [[nodiscard]] uint64_t Key(double x, double y) const;

  double tolerance_m_;
  double slot_m_;
  std::vector<PlanePoint> points_;
  std::vector<uint32_t> next_;  // next point in the slot; itself if last
  std::unordered_map<uint64_t, uint32_t> slots_;
};

// Finds whether an edge is covered by a segment.
class SegmentIndex {
 public:
  SegmentIndex(std::vector<PlaneSegment> segments, double tolerance_m);

  // Whether the edge from a to b lies along a segment that contains the middle
  // of the edge.
  [[nodiscard]] bool Covers(PlanePoint a, PlanePoint b) const;

 private:
  std::vector<PlaneSegment> segments_;
  double tolerance_m_;
  PlaneIndex index_;
};

double DistanceFromLine(PlanePoint p, const PlaneSegment& s);

}  // namespace enfilade
