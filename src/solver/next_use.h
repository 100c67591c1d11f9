// When a cell is needed next. The order of the work is known: receivers come by
// id, round and round, and each has its sources by id, itself last. So of what
// is in memory that can go which is needed last (Belady 1966, "A study of
// replacement algorithms").

#pragma once

#include "base/block_storage.h"
#include "base/ids.h"
#include "base/memory.h"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace enfilade {

class NextUse {
 public:
  // Reads each visible set once.
  NextUse(const BlockStorage& store, size_t cells, MemoryBudget& budget);

  // What it holds of so many cells and visible pairs.
  static uint64_t BytesFor(size_t cells, uint64_t visible_pairs);

  // The work is at this pair.
  void MoveTo(CellId receiver, CellId source) {
    receiver_ = receiver.value;
    source_ = source.value;
  }

  // Grows with the work that comes before the cell's next use; 0: it is in use.
  // That other cells meet it between them does not count.
  [[nodiscard]] uint64_t Distance(CellId cell) const;

 private:
  std::vector<uint32_t> first_;    // by cell: where its list begins
  std::vector<uint32_t> seen_by_;  // receivers that see the cell, ascending
  MemoryCharge charge_;
  uint32_t receiver_ = 0;
  uint32_t source_ = 0;
};

}  // namespace enfilade
