#include "solver/paging/pair_table.h"

#include "base/check.h"
#include "base/error.h"
#include "base/stop.h"
#include "visibility/visible_set.h"

#include <algorithm>

#include <fmt/format.h>

namespace enfilade {

PairTable::PairTable(const BlockStorage& store,
                     size_t cells,
                     MemoryBudget& budget)
    : charge_(budget,
              BytesFor(cells, LoadVisibilitySummary(store).visible_pairs),
              "the order of the work") {
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
      ThrowDamaged(store,
                   fmt::format("has a block '{}' of cells that do not see each "
                               "other",
                               ToString(key)));
    }
    SetLinked(CellId(key.a), CellId(key.b), true);
  });
}

uint64_t PairTable::BytesFor(size_t cells, uint64_t visible_pairs) {
  return sizeof(uint32_t) * (cells + 1 + visible_pairs);
}

std::span<const PairTable::Seer> PairTable::SeersOf(uint32_t cell) const {
  return std::span(seers_).subspan(first_[cell],
                                   first_[cell + 1] - first_[cell]);
}

std::span<const PairTable::Seer> PairTable::SeersFrom(uint32_t cell,
                                                      uint32_t first) const {
  const auto seers = SeersOf(cell);
  const auto at = std::lower_bound(
      seers.begin(), seers.end(), first, [](const Seer& s, uint32_t id) {
        return s.cell < id;
      });
  return {at, seers.end()};
}

std::vector<CellId> PairTable::SeenFrom(CellId cell) const {
  std::vector<CellId> cells;
  for (const Seer& seer : SeersOf(cell.value)) {
    cells.emplace_back(seer.cell);
  }
  return cells;
}

bool PairTable::See(CellId cell, CellId seer) const {
  const auto seers = SeersFrom(cell.value, seer.value);
  return !seers.empty() && seers.front().cell == seer.value;
}

size_t PairTable::IndexOf(CellId cell, CellId seer) const {
  ENFILADE_CHECK(See(cell, seer),
                 "cells {} and {} do not see each other",
                 cell.value,
                 seer.value);
  const auto from_seer = SeersFrom(cell.value, seer.value);
  return first_[cell.Index() + 1] - from_seer.size();
}

bool PairTable::IsLinked(CellId receiver, CellId source) const {
  return seers_[IndexOf(source, receiver)].gathers != 0;
}

void PairTable::SetLinked(CellId receiver, CellId source, bool is_linked) {
  seers_[IndexOf(source, receiver)].gathers = is_linked ? 1 : 0;
  seers_[IndexOf(receiver, source)].sends = is_linked ? 1 : 0;
}

}  // namespace enfilade
