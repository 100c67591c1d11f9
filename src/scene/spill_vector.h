// A growing array of points under the memory budget: pages that do not fit
// into its share wait as scratch blocks in the store.

#pragma once

#include "base/block_storage.h"
#include "base/memory.h"
#include "base/vec.h"

#include <cstdint>
#include <vector>

namespace enfilade {

// Appended to and read at random; never changed. Not thread-safe. Borrows the
// store and the budget. Least recently used pages leave first.
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
    std::vector<Point3> points;  // empty when it is not in memory
    uint64_t last_used = 0;
    bool stored = false;
  };

  void MakeRoom();
  void Load(size_t page);
  void Evict(size_t page);

  BlockStorage* store_;
  MemoryBudget* budget_;
  uint64_t most_pages_;
  uint32_t scratch_key_;
  std::vector<Page> pages_;
  uint64_t resident_pages_ = 0;
  uint64_t clock_ = 0;
  uint64_t size_ = 0;
};

}  // namespace enfilade
