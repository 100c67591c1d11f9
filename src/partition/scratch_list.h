// Lists of records that are read in their order, and may be larger than memory.

#pragma once

#include "base/block_storage.h"
#include "base/bytes.h"
#include "base/memory.h"

#include <cstdint>
#include <functional>
#include <string_view>
#include <vector>

namespace enfilade {

// What some lists take in memory together. What is beyond a share of the budget
// waits in scratch blocks of the store.
class ScratchShelf {
 public:
  // Borrows both. `what` the lists hold, for refusals.
  ScratchShelf(BlockStorage& store,
               MemoryBudget& budget,
               std::string_view what);

  ~ScratchShelf() = default;
  ScratchShelf(const ScratchShelf&) = delete;
  ScratchShelf& operator=(const ScratchShelf&) = delete;

  // Erases what lists have left in the store. Requires that there are none.
  void Clear();

 private:
  friend class ScratchList;

  void Hold(uint64_t bytes);
  void LetGo(uint64_t bytes);

  BlockStorage* store_;
  uint64_t most_bytes_;  // in memory, but for the ends of lists
  uint64_t held_bytes_ = 0;
  uint32_t lists_ = 0;  // so far
  GrowingCharge charge_;
};

// The shelf must outlive it. Not thread-safe. Throws DoesNotFitError where its
// end does not fit.
class ScratchList {
 public:
  // Reads one record.
  using Visitor = std::function<void(ByteReader&)>;

  explicit ScratchList(ScratchShelf& shelf);
  ~ScratchList();
  ScratchList(ScratchList&& other) noexcept;
  ScratchList(const ScratchList&) = delete;
  ScratchList& operator=(const ScratchList&) = delete;
  ScratchList& operator=(ScratchList&&) = delete;

  // Where the next record is to be written, of at most so many bytes.
  ByteWriter& Append(uint64_t most_bytes);

  void Visit(const Visitor& visit) const;

  // Visits all, and lets go of each part of the list when it was visited.
  void Consume(const Visitor& visit);

 private:
  void EndChunk();
  [[nodiscard]] BlockKey KeyOf(size_t chunk) const;
  void VisitChunk(size_t chunk, const Visitor& visit) const;

  ScratchShelf* shelf_;
  uint32_t number_;
  std::vector<Bytes> chunks_;  // empty if it is in the store
  ByteWriter end_;             // not yet a chunk
  uint64_t held_bytes_ = 0;
  uint64_t end_room_ = 0;
};

}  // namespace enfilade
