#include "solver/paging/next_use.h"

#include "base/check.h"
#include "base/error.h"
#include "base/stop.h"

#include <algorithm>

#include <fmt/format.h>

namespace enfilade {

NextUse::NextUse(const BlockStorage& store, size_t cells, MemoryBudget& budget)
    : charge_(budget,
              BytesFor(cells, LoadVisibilitySummary(store).visible_pairs),
              "the order of the work"),
      budget_(&budget) {
  static_assert(sizeof(Seer) == sizeof(uint32_t));
  ENFILADE_CHECK(cells < size_t{1} << 30, "{} cells", cells);
  first_.reserve(cells + 1);
  seers_.reserve(LoadVisibilitySummary(store).visible_pairs);
  first_.push_back(0);
  for (size_t i = 0; i < cells; ++i) {
    ThrowIfStopRequested();
    // Visibility is symmetric: the cells that see a cell are those it sees.
    for (const CellId source : LoadVisibleSources(store, CellId(i))) {
      Seer seer{};
      seer.cell = source.value & ((1U << 30) - 1);
      seers_.push_back(seer);
    }
    ENFILADE_CHECK(seers_.size() <= UINT32_MAX, "{} pairs", seers_.size());
    first_.push_back(static_cast<uint32_t>(seers_.size()));
  }
  store.ForEachKey(BlockKind::kLinks, [&](const BlockKey& key) {
    if (key.a >= cells || key.b >= cells ||
        !See(CellId(key.a), CellId(key.b))) {
      throw DamagedStoreError(fmt::format(
          "{} is of cells that do not see each other", ToString(key)));
    }
    SetLinked(CellId(key.a), CellId(key.b), true);
  });
}

uint64_t NextUse::BytesFor(size_t cells, uint64_t visible_pairs) {
  return sizeof(uint32_t) * (cells + 1 + visible_pairs);
}

std::span<const NextUse::Seer> NextUse::SeersOf(uint32_t cell) const {
  return std::span(seers_).subspan(first_[cell],
                                   first_[cell + 1] - first_[cell]);
}

// The part of the cell's list that begins at the cell `first`.
std::span<const NextUse::Seer> NextUse::SeersFrom(uint32_t cell,
                                                  uint32_t first) const {
  const auto seers = SeersOf(cell);
  const auto at = std::lower_bound(
      seers.begin(), seers.end(), first, [](const Seer& s, uint32_t id) {
        return s.cell < id;
      });
  return {at, seers.end()};
}

std::vector<CellId> NextUse::SeenFrom(CellId cell) const {
  std::vector<CellId> cells;
  for (const Seer& seer : SeersOf(cell.value)) {
    cells.emplace_back(seer.cell);
  }
  return cells;
}

bool NextUse::See(CellId cell, CellId seer) const {
  const auto seers = SeersFrom(cell.value, seer.value);
  return !seers.empty() && seers.front().cell == seer.value;
}

const NextUse::Seer& NextUse::SeerOf(CellId cell, CellId seer) const {
  ENFILADE_CHECK(See(cell, seer),
                 "cells {} and {} do not see each other",
                 cell.value,
                 seer.value);
  return SeersFrom(cell.value, seer.value).front();
}

void NextUse::SetLinked(CellId receiver, CellId source, bool is_linked) {
  const auto at = [this](const Seer& seer) -> Seer& {
    return seers_[static_cast<size_t>(&seer - seers_.data())];
  };
  at(SeerOf(source, receiver)).gathers = is_linked ? 1 : 0;
  at(SeerOf(receiver, source)).sends = is_linked ? 1 : 0;
}

bool NextUse::IsLinked(CellId receiver, CellId source) const {
  return SeerOf(source, receiver).gathers != 0;
}

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
bool NextUse::Gathers(const Seer& seer,
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
  const auto seers = SeersOf(cell);
  return std::any_of(seers.begin(), seers.end(), [&](const Seer& source) {
    const bool comes_before = source.cell >= receiver_ && source.cell < cell;
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
  for (const Seer& seer : SeersFrom(cell, receiver_)) {
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
  for (const Seer& seer : SeersOf(cell)) {
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
  for (const Seer& seer : SeersFrom(cell, receiver_)) {
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
