// Which of many trials of one small probability succeed, at the cost of the
// successes alone: it jumps from one to the next.

#pragma once

#include "base/random.h"

#include <cmath>
#include <cstdint>

namespace enfilade {

class RareDraws {
 public:
  // Trials 0, ..., trials - 1; 0 < probability < 1.
  RareDraws(uint64_t key, double probability, uint64_t trials)
      : random_(key), log_miss_(std::log1p(-probability)), trials_(trials) {
    Jump();
  }

  [[nodiscard]] bool AtEnd() const { return at_ >= trials_; }

  // The trial that succeeded. Requires that it is not at the end.
  [[nodiscard]] uint64_t Trial() const { return at_; }

  void Next() {
    ++at_;
    Jump();
  }

 private:
  void Jump() {
    const double misses = std::log1p(-random_.Next()) / log_miss_;
    const bool is_within =
        at_ < trials_ && misses < static_cast<double>(trials_ - at_);
    at_ = is_within ? at_ + static_cast<uint64_t>(misses) : trials_;
  }

  Random random_;
  double log_miss_;
  uint64_t trials_;
  uint64_t at_ = 0;
};

}  // namespace enfilade
