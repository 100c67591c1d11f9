#include "solver/access_trace.h"

#include "store/belady.h"

#include <algorithm>

namespace enfilade {
namespace {

constexpr size_t kMostAccesses = 1 << 17;
// A part also ends when it has more than one block in so many accesses.
constexpr size_t kAccessesPerBlock = 4;
// An access, its share of a block and what measuring takes: so many bytes, and
// at most this share of what the cache has.
constexpr uint64_t kAccessBytes = 64;
constexpr uint64_t kShare = 32;

}  // namespace

AccessTrace::AccessTrace(uint64_t capacity_bytes)
    : capacity_bytes_(capacity_bytes),
      most_accesses_(std::min<uint64_t>(
          kMostAccesses, capacity_bytes / (kShare * kAccessBytes) + 1)) {}

void AccessTrace::Record(const BlockKey& key, uint64_t bytes) {
  const auto [it, is_new] =
      index_.try_emplace(key, static_cast<uint32_t>(bytes_.size()));
  if (is_new) {
    bytes_.push_back(bytes);
  } else {
    bytes_[it->second] = std::max(bytes_[it->second], bytes);
  }
  Append(it->second);
}

void AccessTrace::RecordHit(const BlockKey& key) {
  const auto it = index_.find(key);
  if (it != index_.end()) {
    Append(it->second);
  }
}

void AccessTrace::Append(uint32_t block) {
  accesses_.push_back(block);
  if (accesses_.size() >= most_accesses_ ||
      bytes_.size() * kAccessesPerBlock >= most_accesses_) {
    Fold();
  }
}

void AccessTrace::Fold() {
  const BeladyReads reads = MeasureBelady(accesses_, bytes_, capacity_bytes_);
  belady_ += reads.optimal_bytes;
  compulsory_ += reads.compulsory_bytes;
  index_.clear();
  bytes_.clear();
  accesses_.clear();
}

void AccessTrace::Measure(uint64_t* belady_bytes, uint64_t* compulsory_bytes) {
  Fold();
  *belady_bytes += belady_;
  *compulsory_bytes += compulsory_;
  belady_ = 0;
  compulsory_ = 0;
}

}  // namespace enfilade
