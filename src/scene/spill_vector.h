// A growing array of points under the memory budget. Pages that do not fit into
// the array's share are evicted to scratch blocks in the store.

#pragma once

#include "base/block_storage.h"
#include "base/memory.h"
#include "base/vec.h"

#include <cstdint>
#include <vector>

namespace enfilade {

// Points are appended and read in any order, but never changed. The least
// recently used pages are evicted first. Not thread-safe. Borrows the store and
// the budget.
class SpillVector {
 public:
  // Keeps at most `resident_bytes` (at least two pages) in memory. Its scratch
  // blocks have the given first key component.
  SpillVector(BlockStorage& store,
              MemoryBudget& budget,
              uint64_t resident_bytes,
              uint32_t scratch_key);
  ~SpillVector();
  SpillVector(const SpillVector&) = delete;
  SpillVector& operator=(const SpillVector&) = delete;
  SpillVector(SpillVector&&) = delete;
  SpillVector& operator=(SpillVector&&) = delete;

  void Append(Point3 p);

  // Requires index < Size().
  Point3 At(uint64_t index);

  [[nodiscard]] uint64_t Size() const { return size_; }

  // Erases the scratch blocks.
  void Clear();

 private:
  struct Page {
    std::vector<Point3> points;  // empty if the page is not in memory
    uint64_t last_used = 0;
    bool stored = false;
  };

  // Makes room for a page, which counts as being in memory from then on.
  void MakeRoomFor(size_t page);
  void Load(size_t page);
  void Evict(size_t page);

  BlockStorage* store_;
  MemoryBudget* budget_;
  uint64_t most_pages_;
  uint32_t scratch_key_;
  std::vector<Page> pages_;
  std::vector<size_t> resident_;  // pages in memory, in no order
  uint64_t clock_ = 0;
  uint64_t size_ = 0;
};

}  // namespace enfilade
