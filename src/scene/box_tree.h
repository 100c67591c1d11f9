// Finds which of many boxes overlap a given box.

#pragma once

#include "base/vec.h"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace enfilade {

// Immutable.
class BoxTree {
 public:
  // The bytes that a tree of so many boxes takes.
  static uint64_t BytesFor(size_t boxes) {
    return boxes * (2 * sizeof(Box3) + sizeof(uint32_t));
  }

  // Empty boxes overlap nothing.
  explicit BoxTree(std::vector<Box3> boxes);

  // Calls visit(i) for every box that overlaps `box`, in an order that is
  // arbitrary but always the same.
  template <typename Visit>
  void ForOverlaps(const Box3& box, const Visit& visit) const {
    ForOverlapsIn(0, order_.size(), box, visit);
  }

 private:
  static constexpr size_t kLeafBoxes = 8;

  template <typename Visit>
  void ForOverlapsIn(size_t begin,
                     size_t end,
                     const Box3& box,
                     const Visit& visit) const {
    if (end - begin <= kLeafBoxes) {
      for (size_t i = begin; i < end; ++i) {
        if (boxes_[order_[i]].Overlaps(box)) {
          visit(order_[i]);
        }
      }
      return;
    }
    const size_t middle = begin + (end - begin) / 2;
    if (!around_[middle].Overlaps(box)) {
      return;
    }
    ForOverlapsIn(begin, middle, box, visit);
    ForOverlapsIn(middle, end, box, visit);
  }

  void Sort(size_t begin, size_t end);

  std::vector<Box3> boxes_;
  std::vector<uint32_t> order_;
  // The box around each range of more than kLeafBoxes boxes, stored at the
  // middle index of the range.
  std::vector<Box3> around_;
};

// The box enlarged by `by` on every side.
inline Box3 Grown(const Box3& box, double by) {
  const Vec3 margin{by, by, by};
  return {box.low - margin, box.high + margin};
}

}  // namespace enfilade
