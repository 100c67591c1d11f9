// From what each cell found by itself to what both ends agree on. Internal to
// src/visibility.

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

// What was found, kept in scratch blocks. Each end's answer never leaves out
// what a ray can reach, so neither does what they have in common. What is read
// back is charged to the budget: the result does not depend on it.
class SetAgreement {
 public:
  SetAgreement(std::span<const CellInfo> cells,
               MemoryBudget& budget,
               BlockStorage& store);

  void Put(CellId cell, const std::vector<SeenCell>& seen);

  // After Put of all cells: finds which cells agree. Between two of them lies
  // what both found to lie there; what one found, if the other sees loosely.
  void Agree();

  // After Agree: without what one of the two does not see after all. Where
  // both are loose, the cells that both see and that meet the hull of their
  // boxes. Writes it to the store; returns how many cells it sees.
  size_t Finish(CellId receiver);

 private:
  using Ids = std::vector<CellId>;

  // A cell whose agreements are sought.
  struct Asking {
    std::vector<SeenCell> mine;
    std::vector<SeenCell> agreed;
    uint64_t agreed_bytes = 0;
    MemoryCharge charge;  // of both, as if all of mine were agreed on
    MemoryCharge more;    // of what lies between by the other end
  };

  [[nodiscard]] std::vector<SeenCell> Load(CellId cell, uint32_t kind) const;
  [[nodiscard]] MemoryCharge ChargeFor(uint64_t bytes) const;
  // The agreements of cells from `first` on, of as many as the budget holds.
  // Returns the one after them.
  size_t AgreeBatch(size_t first);
  [[nodiscard]] std::vector<Asking> LoadBatch(size_t first) const;
  // All cells that they see, ascending.
  static Ids SourcesOf(const std::vector<Asking>& batch);
  // Charges what number `at` has agreed on; where the budget does not hold it,
  // the last ones leave the batch, that one included, unless it is the only
  // one: throws then.
  void ChargeAgreed(size_t at, std::vector<Asking>* batch) const;
  [[nodiscard]] std::shared_ptr<const Ids> AgreedBy(CellId cell);

  std::span<const CellInfo> cells_;
  MemoryBudget* budget_;
  BlockStorage* store_;
  MemoryCharge own_charge_;             // of what there is for each cell
  std::vector<uint64_t> seen_bytes_;    // by cell: what was found, in memory
  std::vector<uint64_t> agreed_bytes_;  // likewise, what was agreed on
  std::map<CellId, std::shared_ptr<const Ids>> agreed_;  // as many as fit
  uint64_t cached_bytes_ = 0;
  MemoryCharge cache_charge_;
};

// A visible set as a block: the sources, their parts, and what lies between as
// a bit for each of them. That is taken from `between_of`, which gets the
// number of a source in the set, ascending: all of it together would be large.
Bytes EncodeVisibleSet(
    const VisibleSet& set,
    const std::function<std::span<const CellId>(size_t source)>& between_of);
// Before it is made, `reserve` is told what it will take.
VisibleSet DecodeVisibleSet(
    const Bytes& bytes,
    const std::function<void(uint64_t bytes)>& reserve = {});

}  // namespace enfilade
