// What the best possible cache reads when several items are needed at a time
// and take more room in memory than in the store.
//
// store/belady.h has one size per item and one item per access, which is what a
// trace of the store's blocks is. Here a step needs all of its items in memory
// together (the two cells of a pair), `held_bytes` is what an item takes there,
// and `stored_bytes` what reading it takes. As there, what is used again last
// goes first: a strong policy that knows the future, no strict lower bound. The
// compulsory bytes are one.

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

// Steps one after the other, each a list of different items.
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

  // Where the items of a step begin among those of all steps.
  [[nodiscard]] size_t First(size_t step) const { return first_[step]; }

 private:
  std::vector<uint32_t> items_;
  std::vector<size_t> first_{0};
};

// What all that occurs takes: in memory together, and to read once.
CacheItem SumOfItems(const Steps& steps, std::span<const CacheItem> items);

// The least memory that has room for each step.
uint64_t LargestStep(const Steps& steps, std::span<const CacheItem> items);

// Stored bytes that are read under a capacity, which the largest step fits in.
uint64_t LeastReads(const Steps& steps,
                    std::span<const CacheItem> items,
                    uint64_t capacity_bytes);

}  // namespace enfilade
