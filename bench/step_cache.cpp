#include "bench/step_cache.h"

#include "base/check.h"

#include <algorithm>
#include <iterator>
#include <limits>
#include <set>
#include <utility>

namespace enfilade {
namespace {

constexpr size_t kNever = std::numeric_limits<size_t>::max();

// For each item of each step, the next step that needs it.
std::vector<size_t> NextUses(const Steps& steps, size_t items) {
  std::vector<size_t> next(steps.First(steps.Size()));
  std::vector<size_t> upcoming(items, kNever);
  for (size_t step = steps.Size(); step-- > 0;) {
    const auto needed = steps.At(step);
    for (size_t i = 0; i < needed.size(); ++i) {
      next[steps.First(step) + i] = std::exchange(upcoming[needed[i]], step);
    }
  }
  return next;
}

uint64_t HeldBytes(std::span<const uint32_t> step,
                   std::span<const CacheItem> items) {
  uint64_t bytes = 0;
  for (const uint32_t item : step) {
    bytes += items[item].held_bytes;
  }
  return bytes;
}

}  // namespace

CacheItem SumOfItems(const Steps& steps, std::span<const CacheItem> items) {
  CacheItem sum;
  std::vector<bool> seen(items.size(), false);
  for (size_t step = 0; step < steps.Size(); ++step) {
    for (const uint32_t item : steps.At(step)) {
      if (!seen[item]) {
        seen[item] = true;
        sum.held_bytes += items[item].held_bytes;
        sum.stored_bytes += items[item].stored_bytes;
      }
    }
  }
  return sum;
}

uint64_t LargestStep(const Steps& steps, std::span<const CacheItem> items) {
  uint64_t largest = 0;
  for (size_t step = 0; step < steps.Size(); ++step) {
    largest = std::max(largest, HeldBytes(steps.At(step), items));
  }
  return largest;
}

uint64_t LeastReads(const Steps& steps,
                    std::span<const CacheItem> items,
                    uint64_t capacity_bytes) {
  const std::vector<size_t> next = NextUses(steps, items.size());
  uint64_t reads = 0;
  // The items in memory that are used again, by the step of their next use.
  std::set<std::pair<size_t, uint32_t>> resident;
  uint64_t resident_bytes = 0;
  for (size_t step = 0; step < steps.Size(); ++step) {
    const auto needed = steps.At(step);
    for (const uint32_t item : needed) {
      if (resident.erase({step, item}) > 0) {
        resident_bytes -= items[item].held_bytes;
      } else {
        reads += items[item].stored_bytes;
      }
    }
    const uint64_t pinned = HeldBytes(needed, items);
    ENFILADE_CHECK(pinned <= capacity_bytes,
                   "a step of {} bytes, capacity {}",
                   pinned,
                   capacity_bytes);
    while (resident_bytes + pinned > capacity_bytes) {
      const auto farthest = std::prev(resident.end());
      resident_bytes -= items[farthest->second].held_bytes;
      resident.erase(farthest);
    }
    for (size_t i = 0; i < needed.size(); ++i) {
      const size_t again = next[steps.First(step) + i];
      if (again != kNever) {
        resident.emplace(again, needed[i]);
        resident_bytes += items[needed[i]].held_bytes;
      }
    }
  }
  return reads;
}

}  // namespace enfilade
