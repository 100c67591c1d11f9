#include "tools/pipeline_limits.h"

#include <algorithm>
#include <limits>
#include <thread>

#include <malloc.h>

namespace enfilade {
namespace {

constexpr int kArenas = 2;
// Larger allocations are mapped of their own and unmapped when freed, and no
// more than so much may lie free at the end of a heap:
// docs/decisions/allocator.md.
constexpr int kMmapBytesNearTheCap = 128 << 10;
constexpr int kTrimBytesNearTheCap = 1 << 20;
constexpr int kMmapBytes = 32 << 20;  // the most that glibc takes
constexpr int kTrimBytes = 64 << 20;

void SetThresholds(int mmap_bytes, int trim_bytes) {
  // Of numbers that other threads read one by one, whenever they allocate.
  // NOLINTBEGIN(concurrency-mt-unsafe)
  mallopt(M_MMAP_THRESHOLD, mmap_bytes);
  mallopt(M_TRIM_THRESHOLD, trim_bytes);
  // NOLINTEND(concurrency-mt-unsafe)
}

void GiveMemoryBackSoon() {
  SetThresholds(kMmapBytesNearTheCap, kTrimBytesNearTheCap);
  ReleaseFreedMemory();
}

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
  mallopt(M_ARENA_MAX, kArenas);  // NOLINT(concurrency-mt-unsafe)
  SetThresholds(kMmapBytes, kTrimBytes);
}

LimitsInForce::LimitsInForce(const RunLimits& limits)
    : budget_(BudgetBytes(limits.memory_cap_bytes)),
      thread_limit_(limits.threads) {
  budget_.OnceHalfIsUsed(&GiveMemoryBackSoon);
}

}  // namespace enfilade
