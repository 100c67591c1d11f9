#include "tools/pipeline_limits.h"

#include <algorithm>
#include <limits>
#include <thread>

namespace enfilade {
namespace {

uint64_t BudgetBytes(const RunLimits& limits) {
  MemoryBudget::SetThreads(std::min(limits.threads, HardwareThreads()));
  if (limits.memory_cap_bytes == 0) {
    // Half of the range, so that sums of a few charges cannot wrap around.
    return std::numeric_limits<uint64_t>::max() / 2;
  }
  return MemoryBudget::BudgetUnderCap(limits.memory_cap_bytes);
}

}  // namespace

uint64_t HardwareThreads() {
  return std::max(1U, std::thread::hardware_concurrency());
}

LimitsInForce::LimitsInForce(const RunLimits& limits)
    : budget_(BudgetBytes(limits)), thread_limit_(limits.threads) {}

}  // namespace enfilade
