// Which stored blocks the solve asked for, in order, whether or not a cache had
// them: what an optimal cache would have read is computed from it
// (store/belady.h). Kept for one round; longer rounds are measured in parts.

#pragma once

#include "base/block_storage.h"

#include <cstdint>
#include <functional>
#include <map>
#include <vector>

namespace enfilade {

class AccessTrace {
 public:
  // `capacity_bytes`: of the optimal cache; what the trace itself takes is a
  // small share of it.
  explicit AccessTrace(uint64_t capacity_bytes);

  // A block was asked for; `bytes` is what reading it takes, stored.
  void Record(const BlockKey& key, uint64_t bytes);

  // A block that was in memory already was asked for again.
  void RecordHit(const BlockKey& key);

  // Adds what was recorded to the sums and forgets it.
  void Measure(uint64_t* belady_bytes, uint64_t* compulsory_bytes);

  // What it holds now, the nodes of the index as they are in memory: bounded,
  // however long the solve goes on.
  [[nodiscard]] uint64_t SizeBytes() const {
    constexpr uint64_t kLinksOfANode = 4 * sizeof(void*);
    return accesses_.capacity() * sizeof(uint32_t) +
           bytes_.capacity() * sizeof(uint64_t) +
           index_.size() * (sizeof(*index_.begin()) + kLinksOfANode);
  }

 private:
  void Append(uint32_t block);
  void Fold();

  uint64_t capacity_bytes_;
  uint64_t most_accesses_;
  std::map<BlockKey, uint32_t> index_;
  std::vector<uint64_t> bytes_;
  std::vector<uint32_t> accesses_;
  uint64_t belady_ = 0;
  uint64_t compulsory_ = 0;
};

}  // namespace enfilade
