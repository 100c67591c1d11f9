// The convex hull of two boxes: all that a segment from one to the other can
// meet (the shaft of Haines and Wallace 1991).

#pragma once

#include "solver/elements/geometry.h"
#include "solver/transfer/box_octets.h"

#include <array>
#include <cstdint>
#include <span>

namespace enfilade {

class BoxHull {
 public:
  BoxHull() = default;
  BoxHull(const Box& a, const Box& b);

  // The box around the hull.
  [[nodiscard]] const Box& Bounds() const { return bounds_; }

  // False only if `box` lies outside the hull. A box beside an edge of the hull
  // may count as overlapping it.
  [[nodiscard]] bool Overlaps(const Box& box) const;

  // The same for each of eight boxes: bit i of the result stands for box i.
  [[nodiscard]] uint32_t Overlapping(const BoxOctet& boxes) const;

 private:
  // Along each axis, seen so that it is a point, the hull is that of two
  // rectangles. Its slanted edges join like corners: at most four along each.
  static constexpr size_t kMostSlanted = 12;

  void AddSlanted(const Box& a, const Box& b, size_t x, size_t y);

  [[nodiscard]] std::span<const HalfSpace> Outside() const {
    return std::span(outside_).first(count_);
  }

  Box bounds_;
  std::array<HalfSpace, kMostSlanted> outside_;  // beyond slanted faces
  size_t count_ = 0;
};

}  // namespace enfilade
