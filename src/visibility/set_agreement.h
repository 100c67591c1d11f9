// Turns what each cell found by itself into visible sets that both ends of each
// pair agree on. Internal to src/visibility.

#pragma once

#include "base/block_storage.h"
#include "base/ids.h"
#include "base/memory.h"
#include "partition/partition.h"
#include "visibility/cell_explorer.h"
#include "visibility/visible_set.h"

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <span>
#include <vector>

namespace enfilade {

// Keeps in scratch blocks what each cell has found. What one end finds never
// leaves out anything that a ray can reach, so neither does the intersection of
// what both ends find. What is read back is charged to the budget, but the
// result does not depend on the budget.
class SetAgreement {
 public:
  SetAgreement(std::span<const CellInfo> cells,
               MemoryBudget& budget,
               BlockStorage& store);

  void Put(CellId cell, const std::vector<SeenCell>& seen);

  // Finds which pairs of cells agree. If both ends list the cells between them,
  // those are the cells that both list; if one end sees the other loosely,
  // those are the cells that the other end lists. To be called after Put of all
  // cells.
  void Agree();

  // Writes the visible set of the receiver to the store and returns how many
  // cells the receiver sees. From the cells between a pair, leaves out those
  // that one of the two ends does not see after all. If both ends see each
  // other loosely, the cells between are those that both see and that meet the
  // hull of the two cells' boxes. To be called after Agree.
  size_t Finish(CellId receiver);

 private:
  using Ids = std::vector<CellId>;

  // A cell whose agreements are sought.
  struct Asking {
    std::vector<SeenCell> mine;
    std::vector<SeenCell> agreed;
    uint64_t agreed_bytes = 0;
    MemoryCharge charge;  // of both, if all of `mine` is agreed on
    MemoryCharge more;    // of cells between that the other end lists
  };

  [[nodiscard]] std::vector<SeenCell> Load(CellId cell, uint32_t kind) const;
  [[nodiscard]] MemoryCharge ChargeFor(uint64_t bytes) const;
  // Finds the agreements of the cells from `first` on, of as many cells as the
  // budget holds. Returns the first cell after them.
  size_t AgreeBatch(size_t first);
  [[nodiscard]] std::vector<Asking> LoadBatch(size_t first) const;
  // All cells that the cells of the batch see, ascending.
  static Ids SourcesOf(const std::vector<Asking>& batch);
  // Charges what cell number `at` of the batch has agreed on. While the budget
  // does not hold this, drops the last cell of the batch, if need be cell `at`
  // itself. Throws DoesNotFitError if a single cell is left and does not fit.
  void ChargeAgreed(size_t at, std::vector<Asking>* batch) const;
  [[nodiscard]] std::shared_ptr<const Ids> AgreedBy(CellId cell);

  std::span<const CellInfo> cells_;
  MemoryBudget* budget_;
  BlockStorage* store_;
  MemoryCharge own_charge_;             // of seen_bytes_ and agreed_bytes_
  std::vector<uint64_t> seen_bytes_;    // by cell: memory of what was found
  std::vector<uint64_t> agreed_bytes_;  // by cell: memory of what was agreed on
  std::map<CellId, std::shared_ptr<const Ids>> agreed_;  // as many as fit
  uint64_t cached_bytes_ = 0;
  MemoryCharge cache_charge_;
};

// Encodes a visible set as a block: the sources, their parts, and for each
// source the cells between as one bit per source of the set. Takes the cells
// between from `between_of`, called with the number of each source in the set
// in ascending order, because all of them together would be large.
Bytes EncodeVisibleSet(
    const VisibleSet& set,
    const std::function<std::span<const CellId>(size_t source)>& between_of);
// The sources alone.
std::vector<CellId> DecodeVisibleSources(std::span<const std::byte> bytes);
// Before the set is made, `reserve` is told how many bytes it takes.
VisibleSet DecodeVisibleSet(
    std::span<const std::byte> bytes,
    const std::function<void(uint64_t bytes)>& reserve = {});

}  // namespace enfilade
