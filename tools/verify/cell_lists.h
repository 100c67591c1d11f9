// A short list for each cell, filled in the order of the cells as far as the
// memory for them goes.

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
  // What lists of so many entries each can take while they grow.
  static uint64_t MostBytes(uint64_t cells, uint64_t entries_each) {
    return cells * (sizeof(uint64_t) + kGrowth * entries_each * sizeof(T));
  }

  // What no list at all would take.
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

  // Whether the next cell may have so many entries. If not, neither it nor any
  // after it has a list.
  [[nodiscard]] bool HasRoomFor(uint64_t entries) const {
    return (entries_.size() + entries) * kGrowth * sizeof(T) <= entry_bytes_;
  }

  void Add(const T& entry) { entries_.push_back(entry); }

  // All that was added since the last call is the next cell's.
  void EndCell() { ends_.push_back(entries_.size()); }

  // Nothing will be added.
  void Finish() {
    entries_.shrink_to_fit();
    charge_.ShrinkTo(entries_.size() * sizeof(T) +
                     LeastBytes(ends_.capacity()));
  }

  // Empty where there is none.
  [[nodiscard]] std::span<const T> Of(std::optional<CellId> cell) const {
    if (!cell || cell->Index() >= ends_.size()) {
      return {};
    }
    const size_t begin = cell->Index() > 0 ? ends_[cell->Index() - 1] : 0;
    return std::span(entries_).subspan(begin, ends_[cell->Index()] - begin);
  }

 private:
  // The array grows by doubling, and is copied once more at the end.
  static constexpr uint64_t kGrowth = 3;

  MemoryCharge charge_;
  uint64_t entry_bytes_ = 0;
  std::vector<uint64_t> ends_;  // of the cells' lists
  std::vector<T> entries_;
};

}  // namespace enfilade
