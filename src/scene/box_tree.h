// Finds which of many boxes overlap a given box, or meet something else.

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
    ForThose([&](const Box3& other) { return other.Overlaps(box); }, visit);
  }

  // The same for the boxes for which meets(box) holds, which must also hold for
  // every box around one of them.
  template <typename Meets, typename Visit>
  void ForThose(const Meets& meets, const Visit& visit) const {
    ForThoseIn(0, order_.size(), meets, visit);
  }

 private:
  static constexpr size_t kLeafBoxes = 8;

  template <typename Meets, typename Visit>
  void ForThoseIn(size_t begin,
                  size_t end,
                  const Meets& meets,
                  const Visit& visit) const {
    if (end - begin <= kLeafBoxes) {
      for (size_t i = begin; i < end; ++i) {
        if (meets(boxes_[order_[i]])) {
          visit(order_[i]);
        }
      }
      return;
    }
    const size_t middle = begin + (end - begin) / 2;
    if (!meets(around_[middle])) {
      return;
    }
    ForThoseIn(begin, middle, meets, visit);
    ForThoseIn(middle, end, meets, visit);
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
