#include "store/belady.h"

#include "base/check.h"

#include <limits>
#include <set>
#include <utility>
#include <vector>

namespace enfilade {
namespace {

constexpr uint32_t kNever = std::numeric_limits<uint32_t>::max();

// For each access, the position of the next access to the same item.
std::vector<uint32_t> NextUses(std::span<const uint32_t> trace, size_t items) {
  std::vector<uint32_t> next(trace.size());
  std::vector<uint32_t> upcoming(items, kNever);
  for (size_t i = trace.size(); i-- > 0;) {
    ENFILADE_CHECK(trace[i] < items, "item {} of {}", trace[i], items);
    next[i] = upcoming[trace[i]];
    upcoming[trace[i]] = static_cast<uint32_t>(i);
  }
  return next;
}

}  // namespace

BeladyReads MeasureBelady(std::span<const uint32_t> trace,
                          std::span<const uint64_t> item_bytes,
                          uint64_t capacity_bytes) {
  ENFILADE_CHECK(trace.size() < kNever, "{} accesses", trace.size());
  const auto next = NextUses(trace, item_bytes.size());
  BeladyReads reads;
  std::vector<bool> seen(item_bytes.size(), false);
  // Resident items that are used again, by the position of their next use;
  // an item that is not drops out for nothing.
  std::set<std::pair<uint32_t, uint32_t>> resident;
  uint64_t resident_bytes = 0;
  for (size_t i = 0; i < trace.size(); ++i) {
    const uint32_t item = trace[i];
    const uint64_t bytes = item_bytes[item];
    if (!seen[item]) {
      seen[item] = true;
      reads.compulsory_bytes += bytes;
    }
    if (resident.erase({static_cast<uint32_t>(i), item}) > 0) {
      resident_bytes -= bytes;
    } else {
      reads.optimal_bytes += bytes;
    }
    if (bytes > capacity_bytes) {
      continue;
    }
    while (resident_bytes + bytes > capacity_bytes) {
      const auto farthest = std::prev(resident.end());
      resident_bytes -= item_bytes[farthest->second];
      resident.erase(farthest);
    }
    if (next[i] != kNever) {
      resident.emplace(next[i], item);
      resident_bytes += bytes;
    }
  }
  return reads;
}

}  // namespace enfilade
