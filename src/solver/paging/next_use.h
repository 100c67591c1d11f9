// When something is needed next. The order of the work is known: receivers come
// by id, round and round, and each has its sources by id, itself last. So of
// what is in memory that can go which is needed last (Belady 1966, "A study of
// replacement algorithms").
//
// A sweep that refines links needs all pairs and what stands between them; one
// that propagates needs pairs that have links and whose source has changed.

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

  // Reads each visible set once, and which pairs have links.
  NextUse(const BlockStorage& store, size_t cells, MemoryBudget& budget);

  // What it holds of so many cells and visible pairs.
  static uint64_t BytesFor(size_t cells, uint64_t visible_pairs);

  // Learns from these rows (borrowed) which cells have something new to send.
  // Until it is called, all have.
  void Watch(const std::vector<CellRow>& rows) { rows_ = &rows; }

  // A sweep begins. No cell has its turn yet.
  void StartSweep(SweepKind kind) { sweep_ = kind; }

  // The receiver's turn begins. `sources`: what it sees, for refinement; else
  // it may be empty.
  void StartTurn(CellId receiver, std::span<const VisibleCell> sources);

  // The work is at this pair.
  void MoveTo(CellId receiver, CellId source);

  // A source that is the receiver itself, which comes last.
  static constexpr uint32_t kItself = std::numeric_limits<uint32_t>::max();

  // The pair that the work is at: receiver, and source or kItself.
  [[nodiscard]] std::pair<uint32_t, uint32_t> At() const {
    return {receiver_, source_};
  }

  // Whether the receiver has links from the source.
  void SetLinked(CellId receiver, CellId source, bool is_linked);

  [[nodiscard]] bool IsLinked(CellId receiver, CellId source) const;

  // What a cell sees, itself included, ascending.
  [[nodiscard]] std::vector<CellId> SeenFrom(CellId cell) const;

  // Distance to the next use, in units that only compare; 0: in use now. This
  // one is of the geometry of a cell.
  [[nodiscard]] uint64_t OfCell(CellId id) const;

  // Of its tree: in propagation a source does with its elements.
  [[nodiscard]] uint64_t OfTree(CellId id) const {
    return sweep_ == SweepKind::kPropagate ? OfTurn(id) : OfCell(id);
  }

  // Of what it sends at most: it is a source in refinement.
  [[nodiscard]] uint64_t OfWeights(CellId id) const {
    return sweep_ == SweepKind::kRefine ? OfCell(id) : kNever;
  }

  // Of its elements and what they have sent last: it is a source in
  // propagation.
  [[nodiscard]] uint64_t OfNews(CellId id) const;

  // Of what a cell has received: its next turn.
  [[nodiscard]] uint64_t OfTurn(CellId id) const;

  // Of what stands in a cell.
  [[nodiscard]] uint64_t OfBlockers(CellId id) const;

  // Of the links of a pair: those of a cell with itself come again and again
  // while its light is balanced.
  [[nodiscard]] uint64_t OfLinks(CellId receiver, CellId source) const;

 private:
  // An entry of a cell's list: a cell that sees it, and which of the two has
  // links from the other.
  struct Seer {
    uint32_t cell : 30;
    uint32_t gathers : 1;  // it has links from the list's cell
    uint32_t sends : 1;    // the list's cell has links from it
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

  // To a place in the turn that comes after so many.
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
  std::vector<Seer> seers_;      // those of a cell ascending, itself included
  MemoryCharge charge_;
  const std::vector<CellRow>* rows_ = nullptr;
  SweepKind sweep_ = SweepKind::kRefine;
  uint32_t receiver_ = 0;
  uint32_t source_ = 0;
  uint64_t place_ = 0;  // of the pair in the turn
  // Cells between the receiver and its sources, each with the place of the
  // source in the turn. Empty where the budget has no room for them.
  std::vector<std::pair<uint32_t, uint32_t>> between_;
  MemoryBudget* budget_;
  MemoryCharge between_charge_;
};

}  // namespace enfilade
