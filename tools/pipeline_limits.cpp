#include "tools/pipeline_limits.h"

#include <algorithm>
#include <limits>
#include <thread>

#include <malloc.h>

namespace enfilade {
namespace {

// Larger allocations are mapped of their own and unmapped when freed.
constexpr int kMmapThresholdBytes = 128 << 10;
constexpr int kTrimThresholdBytes = 1 << 20;
constexpr int kArenas = 2;

uint64_t BudgetBytes(uint64_t cap_bytes) {
  if (cap_bytes == 0) {
    // Half of the range: sums of a few charges cannot wrap around.
    return std::numeric_limits<uint64_t>::max() / 2;
  }
  return MemoryBudget::BudgetUnderCap(cap_bytes);
}

}  // namespace

uint64_t HardwareThreads() {
  return std::max(1U, std::thread::hardware_concurrency());
}

void ConfigureAllocator() {
  // Called before there is a second thread.
  // NOLINTBEGIN(concurrency-mt-unsafe)
  mallopt(M_ARENA_MAX, kArenas);
  mallopt(M_MMAP_THRESHOLD, kMmapThresholdBytes);
  mallopt(M_TRIM_THRESHOLD, kTrimThresholdBytes);
  // NOLINTEND(concurrency-mt-unsafe)
}

LimitsInForce::LimitsInForce(const RunLimits& limits)
    : budget_(BudgetBytes(limits.memory_cap_bytes)),
      thread_limit_(limits.threads) {}

}  // namespace enfilade
