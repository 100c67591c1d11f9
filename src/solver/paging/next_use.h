// Knows when something is needed next. The order of the work is fixed:
// receivers come by id, sweep after sweep, and each receiver has its sources by
// id, itself last. Of the items in memory, the one that is needed last can
// therefore be evicted (Belady 1966, "A study of replacement algorithms").
//
// A sweep that refines links needs all pairs and what stands between their
// cells. A sweep that propagates needs only the pairs that have links and whose
// source has changed.

#pragma once

#include "base/ids.h"
#include "base/memory.h"
#include "solver/paging/pair_table.h"
#include "solver/state/solve_state.h"
#include "visibility/visible_set.h"

#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <utility>
#include <vector>

namespace enfilade {

enum class SweepKind : uint8_t { kRefine, kPropagate };

class NextUse {
 public:
  static constexpr uint64_t kNever = std::numeric_limits<uint64_t>::max() / 2;

  // Pairs and budget must outlive this object.
  NextUse(const PairTable& pairs, MemoryBudget& budget)
      : pairs_(&pairs), budget_(&budget) {}

  // From now on, these rows (borrowed) say which cells have something new to
  // send. Before this call, all cells do.
  void Watch(const std::vector<CellRow>& rows) { rows_ = &rows; }

  // A sweep begins. The place of the work stays the last one's end until
  // StartTurn.
  void StartSweep(SweepKind kind) { sweep_ = kind; }

  // The receiver's turn begins. `sources`: what the receiver sees, for
  // refinement; otherwise it may be empty.
  void StartTurn(CellId receiver, std::span<const VisibleCell> sources);

  // The work is at this pair.
  void MoveTo(CellId receiver, CellId source);

  // Stands for a source that is the receiver itself, which comes last.
  static constexpr uint32_t kItself = std::numeric_limits<uint32_t>::max();

  // The pair that the work is at: receiver, and source or kItself.
  [[nodiscard]] std::pair<uint32_t, uint32_t> At() const {
    return {receiver_, source_};
  }

  // The distance to the next use of a cell's geometry, in units that serve only
  // for comparison; 0: in use now. The functions below return the same for
  // other things.
  [[nodiscard]] uint64_t OfCell(CellId id) const;

  // The same for a cell's tree: in propagation a source needs only its
  // elements.
  [[nodiscard]] uint64_t OfTree(CellId id) const {
    return sweep_ == SweepKind::kPropagate ? OfTurn(id) : OfCell(id);
  }

  // The same for a cell's source weights: used when the cell is a source in
  // refinement.
  [[nodiscard]] uint64_t OfWeights(CellId id) const {
    return sweep_ == SweepKind::kRefine ? OfCell(id) : kNever;
  }

  // The same for a cell's elements and delta: used when the cell is a source in
  // propagation.
  [[nodiscard]] uint64_t OfNews(CellId id) const;

  // The same for what a cell has received: used in the cell's next turn.
  [[nodiscard]] uint64_t OfTurn(CellId id) const;

  // The same for the blockers of a cell.
  [[nodiscard]] uint64_t OfBlockers(CellId id) const;

  // The same for the links of a pair. The links of a cell with itself are used
  // again and again while its light is balanced.
  [[nodiscard]] uint64_t OfLinks(CellId receiver, CellId source) const;

 private:
  [[nodiscard]] uint64_t TurnLength() const { return pairs_->CellCount() + 2; }

  [[nodiscard]] uint64_t TurnsUntilNextSweep() const {
    return pairs_->CellCount() - receiver_;
  }

  [[nodiscard]] uint64_t Place(uint32_t receiver, uint32_t source) const;

  // The distance to a place in the turn that comes after this many turns.
  [[nodiscard]] uint64_t Distance(uint64_t turns, uint64_t place) const {
    return turns * TurnLength() + place - place_;
  }

  [[nodiscard]] bool HasNews(uint32_t receiver, uint32_t source) const;
  [[nodiscard]] bool Gathers(const PairTable::Seer& seer,
                             uint32_t cell,
                             bool is_next_sweep) const;
  [[nodiscard]] bool HasTurn(uint32_t cell) const;
  [[nodiscard]] uint64_t AsSource(uint32_t cell) const;
  [[nodiscard]] uint64_t AsSourceInNextSweep(uint32_t cell) const;

  const PairTable* pairs_;
  const std::vector<CellRow>* rows_ = nullptr;
  SweepKind sweep_ = SweepKind::kRefine;
  uint32_t receiver_ = 0;
  uint32_t source_ = 0;
  uint64_t place_ = 0;  // of the current pair in the turn
  // The cells between the receiver and its sources, each with the place of the
  // source in the turn. Empty if the budget has no room for them.
  std::vector<std::pair<uint32_t, uint32_t>> between_;
  MemoryBudget* budget_;
  MemoryCharge between_charge_;
};

}  // namespace enfilade
