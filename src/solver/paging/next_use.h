// Knows when something is needed next. The order of the work is fixed:
// receivers come by id, sweep after sweep, and each receiver has its sources by
// id, itself last. Of the items in memory, the one that is needed last can
// therefore be evicted (Belady 1966, "A study of replacement algorithms").
//
// A sweep that refines links needs all pairs and what stands between their
// cells. A sweep that propagates needs only the pairs that have links and whose
// source has changed.

#pragma once

#include "base/block_storage.h"
#include "base/ids.h"
#include "base/memory.h"
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

  // Reads each visible set once, and finds which pairs have links.
  NextUse(const BlockStorage& store, size_t cells, MemoryBudget& budget);

  // The bytes that NextUse takes for these numbers of cells and visible pairs.
  static uint64_t BytesFor(size_t cells, uint64_t visible_pairs);

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

  // Whether the receiver has links from the source.
  void SetLinked(CellId receiver, CellId source, bool is_linked);

  [[nodiscard]] bool IsLinked(CellId receiver, CellId source) const;

  // The cells that a cell sees, including itself, in ascending order.
  [[nodiscard]] std::vector<CellId> SeenFrom(CellId cell) const;

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
  // An entry of a cell's list: a cell that sees it, and which of the two cells
  // has links from the other.
  struct Seer {
    uint32_t cell : 30;
    uint32_t gathers : 1;  // this cell has links from the list's cell
    uint32_t sends : 1;    // the list's cell has links from this cell
  };

  [[nodiscard]] bool See(CellId cell, CellId seer) const;
  [[nodiscard]] const Seer& SeerOf(CellId cell, CellId seer) const;
  [[nodiscard]] std::span<const Seer> SeersOf(uint32_t cell) const;
  [[nodiscard]] std::span<const Seer> SeersFrom(uint32_t cell,
                                                uint32_t first) const;

  [[nodiscard]] uint64_t TurnLength() const { return first_.size() + 1; }

  [[nodiscard]] uint64_t TurnsUntilNextSweep() const {
    return first_.size() - 1 - receiver_;
  }

  [[nodiscard]] uint64_t Place(uint32_t receiver, uint32_t source) const;

  // The distance to a place in the turn that comes after this many turns.
  [[nodiscard]] uint64_t Distance(uint64_t turns, uint64_t place) const {
    return turns * TurnLength() + place - place_;
  }

  [[nodiscard]] bool HasNews(uint32_t receiver, uint32_t source) const;
  [[nodiscard]] bool Gathers(const Seer& seer,
                             uint32_t cell,
                             bool is_next_sweep) const;
  [[nodiscard]] bool HasTurn(uint32_t cell) const;
  [[nodiscard]] uint64_t AsSource(uint32_t cell) const;
  [[nodiscard]] uint64_t AsSourceInNextSweep(uint32_t cell) const;

  std::vector<uint32_t> first_;  // by cell: where its list begins
  std::vector<Seer> seers_;      // lists, ascending, with the cell itself
  MemoryCharge charge_;
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
