#include "solver/solution/points_by_cell.h"

#include "base/check.h"

#include <limits>

namespace enfilade {

PointsByCell::PointsByCell(std::span<const PatchPoint> points,
                           size_t cell_count)
    : order_(points.size()), first_(cell_count + 2) {
  ENFILADE_CHECK(points.size() <= std::numeric_limits<uint32_t>::max(),
                 "{} points at a time",
                 points.size());
  for (const PatchPoint& p : points) {
    ++first_[p.cell.Index() + 2];
  }
  for (size_t i = 0; i < cell_count; ++i) {
    if (first_[i + 2] > 0) {
      cells_.emplace_back(i);
    }
    first_[i + 2] += first_[i + 1];
  }
  // first_[cell + 1] moves from the begin of the cell's points to their end,
  // which is where the next cell begins.
  for (size_t i = 0; i < points.size(); ++i) {
    order_[first_[points[i].cell.Index() + 1]++] = static_cast<uint32_t>(i);
  }
}

}  // namespace enfilade
