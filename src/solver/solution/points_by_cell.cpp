#include "solver/solution/points_by_cell.h"

namespace enfilade {

PointsByCell::PointsByCell(std::span<const PatchPoint> points,
                           size_t cell_count)
    : order_(points.size()), first_(cell_count + 2) {
  for (const PatchPoint& p : points) {
    ++first_[p.cell.Index() + 2];
  }
  for (size_t i = 0; i < cell_count; ++i) {
    if (first_[i + 2] > 0) {
      cells_.emplace_back(i);
    }
    first_[i + 2] += first_[i + 1];
  }
  // Each of these moves on to where the next one began.
  for (size_t i = 0; i < points.size(); ++i) {
    order_[first_[points[i].cell.Index() + 1]++] = i;
  }
}

}  // namespace enfilade
