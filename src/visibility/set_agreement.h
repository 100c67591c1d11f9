// From what each cell found by itself to what both ends agree on. Internal to
// src/visibility.

#pragma once

#include "base/block_storage.h"
#include "base/ids.h"
#include "partition/partition.h"
#include "visibility/cell_explorer.h"
#include "visibility/visible_set.h"

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <vector>

namespace enfilade {

// What was found, kept in scratch blocks. Each end's answer never leaves out
// what a ray can reach, so neither does what they have in common.
class SetAgreement {
 public:
  SetAgreement(const Partition& partition, BlockStorage& store)
      : partition_(&partition), store_(&store) {}

  void Put(CellId cell, const std::vector<SeenCell>& seen);

  // After Put of all cells: finds which cells agree. Between two of them lies
  // what both found to lie there; what one found, if the other sees loosely.
  void Agree();

  // After Agree: without what one of the two does not see after all. Where
  // both are loose, the cells that both see and that meet the hull of their
  // boxes.
  VisibleSet Finish(CellId receiver);

 private:
  using Ids = std::vector<CellId>;

  [[nodiscard]] std::vector<SeenCell> Load(CellId cell, uint32_t kind) const;
  // The agreements of cells first to end - 1.
  void AgreeBatch(size_t first, size_t end);
  [[nodiscard]] std::shared_ptr<const Ids> AgreedBy(CellId cell);

  const Partition* partition_;
  BlockStorage* store_;
  std::map<CellId, std::shared_ptr<const Ids>> agreed_;  // as many as fit
  uint64_t agreed_bytes_ = 0;
};

// A visible set as a block: the sources, their parts, and what lies between as
// a bit for each of them.
Bytes EncodeVisibleSet(const VisibleSet& set);
// Before it is made, `reserve` is told what it will take.
VisibleSet DecodeVisibleSet(
    const Bytes& bytes,
    const std::function<void(uint64_t bytes)>& reserve = {});

}  // namespace enfilade
