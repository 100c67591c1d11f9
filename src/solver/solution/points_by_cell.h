// Points on patches, sorted by cell: reading a cell costs far more than a point
// in it.

#pragma once

#include "base/ids.h"

#include <cstddef>
#include <span>
#include <vector>

namespace enfilade {

// A point on a patch, in patch coordinates (partition/patch.h).
struct PatchPoint {
  CellId cell;
  PatchId patch;
  double a = 0;
  double b = 0;
};

class PointsByCell {
 public:
  // Takes a number for each point and two for each cell.
  PointsByCell(std::span<const PatchPoint> points, size_t cell_count);

  // Those in which there are points, ascending.
  [[nodiscard]] std::span<const CellId> Cells() const { return cells_; }

  // The points of a cell by their numbers, ascending.
  [[nodiscard]] std::span<const size_t> Of(CellId cell) const {
    const size_t begin = first_[cell.Index()];
    return All().subspan(begin, first_[cell.Index() + 1] - begin);
  }

  // Those of all cells, one after the other.
  [[nodiscard]] std::span<const size_t> All() const { return order_; }

 private:
  std::vector<CellId> cells_;
  std::vector<size_t> order_;
  std::vector<size_t> first_;  // by cell: where its points begin; two more
};

}  // namespace enfilade
