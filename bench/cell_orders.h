// Orders in which the receivers of a sweep may come.

#pragma once

#include "base/vec.h"

#include <cstdint>
#include <vector>

namespace enfilade {

// A cell as orders see it.
struct OrderedCell {
  Point3 centre;
  std::vector<uint32_t> sees;  // cells, ascending, itself included
  uint64_t bytes = 0;          // in memory
};

// Cells, each once, in the order of their turns.
using CellOrder = std::vector<uint32_t>;

CellOrder StoreOrder(size_t cells);
CellOrder RandomOrder(size_t cells);

// Along Hilbert's curve through the centres.
CellOrder HilbertOrder(const std::vector<OrderedCell>& cells);

// Reverse Cuthill-McKee of who sees whom.
CellOrder CuthillMcKeeOrder(const std::vector<OrderedCell>& cells);

// Next comes the cell of whose visible set most bytes are in a cache of this
// capacity, which forgets what was used longest ago; or, of whose visible set
// the fewest are not.
enum class GreedyRule { kMostResident, kLeastMissing };
CellOrder GreedyOrder(const std::vector<OrderedCell>& cells,
                      uint64_t capacity_bytes,
                      GreedyRule rule);

// A short path through all cells, where it is as far from one to another as
// only one of the two sees, in bytes: nearest neighbours, then 2-opt; or 2-opt
// of another order.
CellOrder PathOrder(const std::vector<OrderedCell>& cells);
CellOrder ShortenedOrder(const std::vector<OrderedCell>& cells,
                         CellOrder order);

}  // namespace enfilade
