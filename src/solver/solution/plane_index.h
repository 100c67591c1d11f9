// Finding things in a plane: boxes, equal points, segments below an edge.

#pragma once

#include "solver/solution/coplanar.h"

#include <array>
#include <cstdint>
#include <span>
#include <unordered_map>
#include <vector>

namespace enfilade {

// Finds things by the boxes around them, in the plane.
class PlaneIndex {
 public:
  struct Box {
    PlanePoint low{1e300, 1e300};
    PlanePoint high{-1e300, -1e300};

    void Include(PlanePoint p);
  };

  // Boxes are indexed in their order; `margin_m` is added around each.
  PlaneIndex(std::span<const Box> boxes, double margin_m);

  // Indices in rising order; a superset of the boxes that contain `p`. Valid as
  // long as the index.
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

// Gives points that are closer than a tolerance one number.
class PointWelder {
 public:
  explicit PointWelder(double tolerance_m);

  // The point's number: that of an earlier one, or the next.
  uint32_t Add(PlanePoint p);

  [[nodiscard]] const std::vector<PlanePoint>& Points() const {
    return points_;
  }

  // Of a point, in all.
  static constexpr uint64_t kPointBytes = 96;

 private:
  [[nodiscard]] uint64_t Key(double x, double y) const;

  double tolerance_m_;
  double slot_m_;
  std::vector<PlanePoint> points_;
  std::vector<uint32_t> next_;  // point of the same slot; itself: none
  std::unordered_map<uint64_t, uint32_t> slots_;
};

// Segments, to be found by the edges they cover.
class SegmentIndex {
 public:
  SegmentIndex(std::vector<PlaneSegment> segments, double tolerance_m);

  // Whether the edge a, b lies along a segment and its middle on it.
  [[nodiscard]] bool Covers(PlanePoint a, PlanePoint b) const;

 private:
  std::vector<PlaneSegment> segments_;
  double tolerance_m_;
  PlaneIndex index_;
};

double DistanceFromLine(PlanePoint p, const PlaneSegment& s);

}  // namespace enfilade
