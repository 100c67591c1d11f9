// The bytes that the best possible cache reads for a given list of steps.
//
// A step needs all of its items in memory at once (the two cells of a pair). An
// item takes `held_bytes` in memory; reading the item takes `stored_bytes`. As
// in store/belady.h, the item whose next use is farthest away is evicted first.
// That is a strong policy that knows the future, but no strict lower bound. The
// compulsory bytes, every item read once, are a strict lower bound.

#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace enfilade {

struct CacheItem {
  uint64_t held_bytes = 0;
  uint64_t stored_bytes = 0;
};

// A sequence of steps, each of which is a list of different items.
class Steps {
 public:
  void Add(std::span<const uint32_t> items) {
    items_.insert(items_.end(), items.begin(), items.end());
    first_.push_back(items_.size());
  }

  [[nodiscard]] size_t Size() const { return first_.size() - 1; }

  [[nodiscard]] std::span<const uint32_t> At(size_t step) const {
    return std::span(items_).subspan(first_[step],
                                     first_[step + 1] - first_[step]);
  }

  // The index of the step's first item in the items of all steps.
  [[nodiscard]] size_t First(size_t step) const { return first_[step]; }

 private:
  std::vector<uint32_t> items_;
  std::vector<size_t> first_{0};
};

// The bytes of all items that occur in the steps: held in memory together, and
// stored, which is what reading each of them once takes.
CacheItem SumOfItems(const Steps& steps, std::span<const CacheItem> items);

// The least memory that is enough for every step.
uint64_t LargestStep(const Steps& steps, std::span<const CacheItem> items);

// The stored bytes that are read with this capacity. The capacity must be at
// least LargestStep.
uint64_t LeastReads(const Steps& steps,
                    std::span<const CacheItem> items,
                    uint64_t capacity_bytes);

}  // namespace enfilade
