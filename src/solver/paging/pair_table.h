// Which cells see each other, and which of them have links.

#pragma once

#include "base/block_storage.h"
#include "base/ids.h"
#include "base/memory.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace enfilade {

class PairTable {
 public:
  // An entry of a cell's list: a cell that sees it, and which of the two cells
  // has links from the other.
  struct Seer {
    uint32_t cell : 30;
    uint32_t gathers : 1;  // this cell has links from the list's cell
    uint32_t sends : 1;    // the list's cell has links from this cell
  };

  // Reads each visible set once, and finds which pairs have links.
  PairTable(const BlockStorage& store, size_t cells, MemoryBudget& budget);

  // The bytes that the table takes for these numbers of cells and visible
  // pairs.
  static uint64_t BytesFor(size_t cells, uint64_t visible_pairs);

  [[nodiscard]] size_t CellCount() const { return first_.size() - 1; }

  // The cells that a cell sees, including itself, in ascending order.
  [[nodiscard]] std::vector<CellId> SeenFrom(CellId cell) const;

  // The cells that see a cell, in ascending order, with the cell itself; the
  // second: from the cell `first` on.
  [[nodiscard]] std::span<const Seer> SeersOf(uint32_t cell) const;
  [[nodiscard]] std::span<const Seer> SeersFrom(uint32_t cell,
                                                uint32_t first) const;

  // Whether the receiver has links from the source. The two must see each
  // other.
  [[nodiscard]] bool IsLinked(CellId receiver, CellId source) const;
  void SetLinked(CellId receiver, CellId source, bool is_linked);

 private:
  [[nodiscard]] bool See(CellId cell, CellId seer) const;
  [[nodiscard]] size_t IndexOf(CellId cell, CellId seer) const;

  std::vector<uint32_t> first_;  // by cell: where its list begins; one more
  std::vector<Seer> seers_;      // the lists
  MemoryCharge charge_;
};

}  // namespace enfilade
