#include "scene/box_tree.h"

#include <algorithm>
#include <numeric>
#include <utility>

namespace enfilade {

BoxTree::BoxTree(std::vector<Box3> boxes)
    : boxes_(std::move(boxes)), order_(boxes_.size()), around_(boxes_.size()) {
  std::iota(order_.begin(), order_.end(), 0U);
  Sort(0, order_.size());
}

// Halves the range at the median along the longest axis; the index of a box
// breaks ties.
void BoxTree::Sort(size_t begin, size_t end) {
  if (end - begin <= kLeafBoxes) {
    return;
  }
  Box3 around;
  for (size_t i = begin; i < end; ++i) {
    around.Include(boxes_[order_[i]]);
  }
  const size_t middle = begin + (end - begin) / 2;
  around_[middle] = around;
  const Vec3 extent = around.Extent();
  size_t axis = extent.y > extent.x ? 1 : 0;
  axis = extent.z > extent[axis] ? 2 : axis;
  const auto key = [&](uint32_t i) {
    const Box3& box = boxes_[i];  // the ends of an empty box add up to NaN
    return std::pair(box.IsEmpty() ? 0 : box.low[axis] + box.high[axis], i);
  };
  const auto at = [&](size_t i) {
    return order_.begin() + static_cast<std::ptrdiff_t>(i);
  };
  std::nth_element(at(begin), at(middle), at(end), [&](uint32_t a, uint32_t b) {
    return key(a) < key(b);
  });
  Sort(begin, middle);
  Sort(middle, end);
}

}  // namespace enfilade
