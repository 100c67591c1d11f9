#include "solver/access_trace.h"

#include "store/belady.h"

#include <algorithm>

namespace enfilade {
namespace {

constexpr size_t kMostAccesses = 1 << 17;
constexpr size_t kMostBlocks = 1 << 15;

}  // namespace

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
  if (accesses_.size() >= kMostAccesses || bytes_.size() >= kMostBlocks) {
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
