// Points on patches, sorted by cell: reading a cell costs far more than a point
// in it.

#pragma once

#include "base/ids.h"

#include <cstddef>
#include <cstdint>
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
  // The bytes that a point takes: its number.
  static constexpr uint64_t kBytesPerPoint = sizeof(uint32_t);

  // Takes kBytesPerPoint for each point and a few numbers for each cell.
  // Requires fewer than 2^32 points.
  PointsByCell(std::span<const PatchPoint> points, size_t cell_count);

  // The cells that contain points, ascending.
  [[nodiscard]] std::span<const CellId> Cells() const { return cells_; }

  // The points of a cell by their numbers, ascending.
  [[nodiscard]] std::span<const uint32_t> Of(CellId cell) const {
    return From(cell, cell);
  }

  // The points of all cells from `first` to `last`, cell by cell.
  [[nodiscard]] std::span<const uint32_t> From(CellId first,
                                               CellId last) const {
    const size_t begin = first_[first.Index()];
    return All().subspan(begin, first_[last.Index() + 1] - begin);
  }

  [[nodiscard]] std::span<const uint32_t> All() const { return order_; }

 private:
  std::vector<CellId> cells_;
  std::vector<uint32_t> order_;
  std::vector<uint32_t> first_;  // by cell: begin of its points; two more
};

}  // namespace enfilade
