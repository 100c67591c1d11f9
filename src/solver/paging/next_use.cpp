#include "solver/paging/next_use.h"

#include <algorithm>

namespace enfilade {

// The place of the source in the receiver's turn; the receiver itself comes
// last.
uint64_t NextUse::Place(uint32_t receiver, uint32_t source) const {
  return source == receiver ? TurnLength() - 1 : source + uint64_t{1};
}

void NextUse::StartTurn(CellId receiver, std::span<const VisibleCell> sources) {
  receiver_ = receiver.value;
  source_ = 0;
  place_ = 0;
  FreeVector(&between_);
  between_charge_.Reset();
  size_t count = 0;
  for (const VisibleCell& v : sources) {
    count += v.between.size();
  }
  const uint64_t bytes = count * sizeof(between_[0]);
  if (bytes > budget_->FreeBytes() || budget_->InUseExcess(bytes) > 0) {
    return;
  }
  between_charge_ = MemoryCharge(*budget_, bytes, "the order of a turn");
  between_.reserve(count);
  for (const VisibleCell& v : sources) {
    for (const CellId cell : v.between) {
      between_.emplace_back(
          cell.value, static_cast<uint32_t>(Place(receiver_, v.source.value)));
    }
  }
  std::sort(between_.begin(), between_.end());
}

void NextUse::MoveTo(CellId receiver, CellId source) {
  receiver_ = receiver.value;
  source_ = source == receiver ? kItself : source.value;
  place_ = Place(receiver.value, source.value);
}

bool NextUse::HasNews(uint32_t receiver, uint32_t source) const {
  return rows_ == nullptr ||
         (*rows_)[source].published > (*rows_)[receiver].processed;
}

// Whether the seer will use `cell` as a source in its turn.
bool NextUse::Gathers(const PairTable::Seer& seer,
                      uint32_t cell,
                      bool is_next_sweep) const {
  if (seer.cell == cell) {
    return false;
  }
  if (sweep_ == SweepKind::kRefine) {
    return !is_next_sweep || seer.gathers != 0;
  }
  // A cell whose turn is yet to come in this sweep may still change.
  return seer.gathers != 0 &&
         (HasNews(seer.cell, cell) || (is_next_sweep && cell > receiver_));
}

// Whether a cell that comes later in this sweep will have something to gather
// in its turn.
bool NextUse::HasTurn(uint32_t cell) const {
  if (sweep_ == SweepKind::kRefine) {
    return true;
  }
  const auto seers = pairs_->SeersOf(cell);
  return std::any_of(
      seers.begin(), seers.end(), [&](const PairTable::Seer& source) {
        const bool comes_before =
            source.cell >= receiver_ && source.cell < cell;
        return source.sends != 0 && source.cell != cell &&
               (comes_before || HasNews(cell, source.cell));
      });
}

uint64_t NextUse::OfCell(CellId id) const {
  const uint32_t cell = id.value;
  if (cell == receiver_) {
    return 0;
  }
  return std::min(OfTurn(id),
                  std::min(AsSource(cell), AsSourceInNextSweep(cell)));
}

uint64_t NextUse::OfNews(CellId id) const {
  const uint32_t cell = id.value;
  const uint64_t next = AsSourceInNextSweep(cell);
  return sweep_ == SweepKind::kRefine ? next : std::min(AsSource(cell), next);
}

// The distance to the cell's next use as a source in this sweep.
uint64_t NextUse::AsSource(uint32_t cell) const {
  const uint64_t place = Place(receiver_, cell);
  for (const PairTable::Seer& seer : pairs_->SeersFrom(cell, receiver_)) {
    if (seer.cell == cell) {
      continue;
    }
    if (seer.cell == receiver_ && place == place_) {
      return 0;
    }
    const bool is_ahead = seer.cell > receiver_ || place > place_;
    if (is_ahead && Gathers(seer, cell, false)) {
      return Distance(seer.cell - receiver_, Place(seer.cell, cell));
    }
  }
  return kNever;
}

uint64_t NextUse::AsSourceInNextSweep(uint32_t cell) const {
  for (const PairTable::Seer& seer : pairs_->SeersOf(cell)) {
    if (Gathers(seer, cell, true)) {
      return Distance(TurnsUntilNextSweep() + seer.cell,
                      Place(seer.cell, cell));
    }
  }
  return kNever;
}

uint64_t NextUse::OfTurn(CellId id) const {
  const uint32_t cell = id.value;
  if (cell == receiver_) {
    return 0;
  }
  const bool is_ahead = cell > receiver_ && HasTurn(cell);
  return Distance(is_ahead ? cell - receiver_ : TurnsUntilNextSweep() + cell,
                  0);
}

uint64_t NextUse::OfBlockers(CellId id) const {
  if (sweep_ == SweepKind::kPropagate) {
    return kNever;
  }
  const uint32_t cell = id.value;
  const auto in_turn =
      std::lower_bound(between_.begin(),
                       between_.end(),
                       std::pair(cell, static_cast<uint32_t>(place_)));
  if (in_turn != between_.end() && in_turn->first == cell) {
    return in_turn->second - place_;
  }
  // If a cell has this one between itself and a source, it also sees this one.
  for (const PairTable::Seer& seer : pairs_->SeersFrom(cell, receiver_)) {
    if (between_.empty() && seer.cell == receiver_) {
      return 1;
    }
    if (seer.cell > receiver_) {
      return Distance(seer.cell - receiver_, 1);
    }
  }
  return kNever;
}

uint64_t NextUse::OfLinks(CellId receiver, CellId source) const {
  const uint64_t place = Place(receiver.value, source.value);
  if (receiver.value == receiver_ && source == receiver) {
    return place - place_ + 1;
  }
  const bool is_ahead = receiver.value > receiver_ ||
                        (receiver.value == receiver_ && place > place_);
  // Refinement replaces the links of the pairs that it comes to.
  if (sweep_ == SweepKind::kRefine && is_ahead) {
    return kNever;
  }
  return Distance(is_ahead ? receiver.value - receiver_
                           : TurnsUntilNextSweep() + receiver.value,
                  place);
}

}  // namespace enfilade
