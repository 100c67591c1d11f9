// Orders in which a sweep may visit its receivers.

#pragma once

#include "base/vec.h"

#include <cstdint>
#include <vector>

namespace enfilade {

// The data of a cell from which the orders are made.
struct OrderedCell {
  Point3 centre;
  std::vector<uint32_t> sees;  // cells, ascending, including this one
  uint64_t bytes = 0;          // in memory
};

// Every cell once, in the order in which the cells are receivers.
using CellOrder = std::vector<uint32_t>;

CellOrder StoreOrder(size_t cells);
CellOrder RandomOrder(size_t cells);

// The order along the Hilbert curve through the centres.
CellOrder HilbertOrder(const std::vector<OrderedCell>& cells);

// Reverse Cuthill-McKee order of the graph of cells that see each other.
CellOrder CuthillMcKeeOrder(const std::vector<OrderedCell>& cells);

// Greedy orders that simulate a cache of this capacity, which evicts the least
// recently used cells. The next cell is the one whose visible set has the most
// bytes in the cache (kMostResident) or the fewest outside it (kLeastMissing).
enum class GreedyRule { kMostResident, kLeastMissing };
CellOrder GreedyOrder(const std::vector<OrderedCell>& cells,
                      uint64_t capacity_bytes,
                      GreedyRule rule);

// Short paths through all cells. The distance of two cells is the bytes of the
// cells that only one of the two sees. PathOrder goes to the nearest neighbour,
// then improves the path by 2-opt; ShortenedOrder applies 2-opt to `order`.
CellOrder PathOrder(const std::vector<OrderedCell>& cells);
CellOrder ShortenedOrder(const std::vector<OrderedCell>& cells,
                         CellOrder order);

}  // namespace enfilade
