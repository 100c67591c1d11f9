#include "tools/pipeline_limits.h"

#include <algorithm>
#include <limits>
#include <thread>

namespace enfilade {
namespace {

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

LimitsInForce::LimitsInForce(const RunLimits& limits)
    : budget_(BudgetBytes(limits.memory_cap_bytes)),
      thread_limit_(limits.threads) {}

}  // namespace enfilade
