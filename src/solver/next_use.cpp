#include "solver/next_use.h"

#include "visibility/visible_set.h"

#include <algorithm>
#include <span>

namespace enfilade {

NextUse::NextUse(const BlockStorage& store, size_t cells, MemoryBudget& budget)
    : charge_(budget,
              BytesFor(cells, LoadVisibilitySummary(store).visible_pairs),
              "the order of the work") {
  first_.reserve(cells + 1);
  seen_by_.reserve(LoadVisibilitySummary(store).visible_pairs);
  first_.push_back(0);
  for (size_t i = 0; i < cells; ++i) {
    // Visibility is symmetric: who sees the cell is whom it sees.
    for (const VisibleCell& v : LoadVisibleSet(store, CellId(i))) {
      seen_by_.push_back(v.source.value);
    }
    first_.push_back(static_cast<uint32_t>(seen_by_.size()));
  }
}

uint64_t NextUse::BytesFor(size_t cells, uint64_t visible_pairs) {
  return sizeof(uint32_t) * (cells + 1 + visible_pairs);
}

uint64_t NextUse::Distance(CellId cell) const {
  if (cell.value == receiver_ || cell.value == source_) {
    return 0;
  }
  const std::span<const uint32_t> seen_by = std::span(seen_by_).subspan(
      first_[cell.Index()], first_[cell.Index() + 1] - first_[cell.Index()]);
  const uint64_t cells = first_.size() - 1;
  // Within the turn of the receiver; its own comes last.
  const bool is_ahead = source_ != receiver_ && cell.value > source_;
  if (is_ahead &&
      std::binary_search(seen_by.begin(), seen_by.end(), receiver_)) {
    return cell.value - source_;
  }
  const auto later =
      std::upper_bound(seen_by.begin(), seen_by.end(), receiver_);
  // As a receiver it is needed at the very beginning of its turn.
  uint64_t turns = cell.value > receiver_ ? cell.value - receiver_
                                          : cells + cell.value - receiver_;
  if (later != seen_by.end()) {
    turns = std::min<uint64_t>(turns, *later - receiver_);
  } else if (!seen_by.empty()) {
    turns = std::min(turns, cells + seen_by.front() - receiver_);
  }
  return turns * cells + cell.value;
}

}  // namespace enfilade
