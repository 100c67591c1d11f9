// The walls inside a region of the tree, in lists that may be larger than
// memory.

#pragma once

#include "base/block_storage.h"
#include "base/bytes.h"
#include "base/memory.h"
#include "partition/polygon.h"

#include <cstdint>
#include <functional>
#include <vector>

namespace enfilade {

// The part of a wall inside a region.
struct WallFragment {
  Polygon polygon;
  Plane plane;               // of the whole wall
  uint32_t plane_group = 0;  // see PlaneGroups
};

// What all lists of a tree take in memory together. What is beyond a share of
// the budget waits in scratch blocks of the store.
class FragmentShelf {
 public:
  // Borrows both.
  FragmentShelf(BlockStorage& store, MemoryBudget& budget);

  ~FragmentShelf() = default;
  FragmentShelf(const FragmentShelf&) = delete;
  FragmentShelf& operator=(const FragmentShelf&) = delete;

  // Erases what lists have left in the store. Requires that there are none.
  void Clear();

 private:
  friend class FragmentList;

  void Hold(uint64_t bytes);
  void LetGo(uint64_t bytes);

  BlockStorage* store_;
  uint64_t most_bytes_;  // in memory, but for the ends of lists
  uint64_t held_bytes_ = 0;
  uint32_t lists_ = 0;  // so far
  GrowingCharge charge_;
};

// Fragments in their order. The shelf must outlive it. Not thread-safe.
class FragmentList {
 public:
  using Visitor = std::function<void(const WallFragment&)>;

  explicit FragmentList(FragmentShelf& shelf);
  ~FragmentList();
  FragmentList(FragmentList&& other) noexcept;
  FragmentList(const FragmentList&) = delete;
  FragmentList& operator=(const FragmentList&) = delete;
  FragmentList& operator=(FragmentList&&) = delete;

  [[nodiscard]] uint64_t Size() const { return size_; }

  void Add(const WallFragment& fragment);

  // What is visited lasts as long as the call.
  void Visit(const Visitor& visit) const;

  // Visits all, and lets go of each part of the list when it was visited.
  void Consume(const Visitor& visit);

 private:
  void MakeRoom(uint64_t bytes);
  void EndChunk();
  [[nodiscard]] BlockKey KeyOf(size_t chunk) const;
  void VisitChunk(size_t chunk, const Visitor& visit) const;

  FragmentShelf* shelf_;
  uint32_t number_;
  uint64_t size_ = 0;
  std::vector<Bytes> chunks_;  // empty if it is in the store
  ByteWriter end_;             // not yet a chunk
  uint64_t held_bytes_ = 0;
  uint64_t end_room_ = 0;
};

}  // namespace enfilade
