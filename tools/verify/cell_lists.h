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
  // The bytes of lists of `entries_each` entries.
  static uint64_t MostBytes(uint64_t cells, uint64_t entries_each) {
    return cells * (sizeof(uint64_t) + entries_each * sizeof(T));
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
    // Never grows: a vector that grows by doubling holds three times what it
    // needs for a while. What is not written to takes no memory.
    entries_.reserve((bytes - LeastBytes(cells)) / sizeof(T));
    ends_.reserve(cells);
  }

  // The entries that the remaining cells may have together.
  [[nodiscard]] uint64_t Room() const {
    return entries_.capacity() - entries_.size();
  }

  // Whether the next cell may have this many entries. If not, that cell and all
  // later ones get no list.
  [[nodiscard]] bool HasRoomFor(uint64_t entries) const {
    return entries <= Room();
  }

  void Add(const T& entry) { entries_.push_back(entry); }

  // Ends the next cell's list, which holds the entries added since the last
  // call.
  void EndCell() { ends_.push_back(entries_.size()); }

  // Gives back the charge for what the lists do not use. No entry may be added
  // afterwards.
  void Finish() {
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
  MemoryCharge charge_;
  std::vector<uint64_t> ends_;  // of the cells' lists
  std::vector<T> entries_;
};

}  // namespace enfilade
