// A short list of entries for each cell, filled in the order of the cells until
// the memory for the lists is used up.

#pragma once

#include "base/ids.h"
#include "base/memory.h"

#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

namespace enfilade {

template <typename T>
class CellLists {
 public:
  // The most bytes that lists of `entries_each` entries take while they grow.
  static uint64_t MostBytes(uint64_t cells, uint64_t entries_each) {
    return cells * (sizeof(uint64_t) + kGrowth * entries_each * sizeof(T));
  }

  // The bytes that empty lists take.
  static uint64_t LeastBytes(uint64_t cells) {
    return cells * sizeof(uint64_t);
  }

  // Requires at least LeastBytes. `what` names the lists to the budget.
  void Reserve(MemoryBudget& budget,
               uint64_t cells,
               uint64_t bytes,
               std::string_view what) {
    charge_ = MemoryCharge(budget, bytes, what);
    entry_bytes_ = bytes - LeastBytes(cells);
    ends_.reserve(cells);
  }

  // Whether the next cell may have this many entries. If not, that cell and all
  // later ones get no list.
  [[nodiscard]] bool HasRoomFor(uint64_t entries) const {
    return (entries_.size() + entries) * kGrowth * sizeof(T) <= entry_bytes_;
  }

  void Add(const T& entry) { entries_.push_back(entry); }

  // Ends the next cell's list, which holds the entries added since the last
  // call.
  void EndCell() { ends_.push_back(entries_.size()); }

  // Frees what the lists do not use. No entry may be added afterwards.
  void Finish() {
    entries_.shrink_to_fit();
    charge_.ShrinkTo(entries_.size() * sizeof(T) +
                     LeastBytes(ends_.capacity()));
  }

  // The cell's list; empty if the cell is unknown or has no list.
  [[nodiscard]] std::span<const T> Of(std::optional<CellId> cell) const {
    if (!cell || cell->Index() >= ends_.size()) {
      return {};
    }
    const size_t begin = cell->Index() > 0 ? ends_[cell->Index() - 1] : 0;
    return std::span(entries_).subspan(begin, ends_[cell->Index()] - begin);
  }

 private:
  // Capacity over size at the peak: the array grows by doubling, and is copied
  // once more at the end.
  static constexpr uint64_t kGrowth = 3;

  MemoryCharge charge_;
  uint64_t entry_bytes_ = 0;
  std::vector<uint64_t> ends_;  // of the cells' lists
  std::vector<T> entries_;
};

}  // namespace enfilade
