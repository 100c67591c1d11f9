// The bounds of one run of the program: memory and threads. No result depends
// on them.

#pragma once

#include "base/memory.h"
#include "base/parallel.h"

#include <cstdint>

namespace enfilade {

struct RunLimits {
  uint64_t memory_cap_bytes = 1ULL << 30;  // of the whole process; 0: none
  uint64_t threads = 1;
};

// Number of the machine's hardware threads; at least 1.
uint64_t HardwareThreads();

// Applies the limits as long as this object lives. Throws DoesNotFitError if
// the cap leaves no budget.
class LimitsInForce {
 public:
  explicit LimitsInForce(const RunLimits& limits);

  [[nodiscard]] MemoryBudget& Budget() { return budget_; }

 private:
  MemoryBudget budget_;
  ThreadLimit thread_limit_;
};

}  // namespace enfilade
