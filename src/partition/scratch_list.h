// Lists of records that are read in order and may be larger than memory.

#pragma once

#include "base/block_storage.h"
#include "base/bytes.h"
#include "base/memory.h"

#include <cstdint>
#include <functional>
#include <string_view>
#include <vector>

namespace enfilade {

// The memory that a group of lists shares. What exceeds a share of the budget
// is written to scratch blocks of the store.
class ScratchShelf {
 public:
  // Borrows the store and the budget. `what` says in error messages what the
  // lists hold.
  ScratchShelf(BlockStorage& store,
               MemoryBudget& budget,
               std::string_view what);

  ~ScratchShelf() = default;
  ScratchShelf(const ScratchShelf&) = delete;
  ScratchShelf& operator=(const ScratchShelf&) = delete;

  // Erases what lists have left in the store. Requires that no list holds any
  // memory.
  void Clear();

 private:
  friend class ScratchList;

  void Hold(uint64_t bytes);
  void LetGo(uint64_t bytes);

  BlockStorage* store_;
  // Most bytes in memory, not counting the ends of lists.
  uint64_t most_bytes_;
  uint64_t held_bytes_ = 0;
  uint32_t lists_ = 0;  // lists made so far
  GrowingCharge charge_;
};

// A list on a shelf, which must outlive it. Not thread-safe. Throws
// DoesNotFitError if the end of the list does not fit into the budget.
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

  // Returns the writer for the next record, which may have at most
  // `most_bytes`.
  ByteWriter& Append(uint64_t most_bytes);

  void Visit(const Visitor& visit) const;

  // Visits all records and frees each part of the list once it was visited.
  void Consume(const Visitor& visit);

 private:
  void EndChunk();
  [[nodiscard]] BlockKey KeyOf(size_t chunk) const;
  void VisitChunk(size_t chunk, const Visitor& visit) const;

  ScratchShelf* shelf_;
  uint32_t number_;
  // An empty chunk is in the store.
  std::vector<Bytes> chunks_;
  // The records after the last chunk.
  ByteWriter end_;
  uint64_t held_bytes_ = 0;
  uint64_t end_room_ = 0;
};

}  // namespace enfilade
