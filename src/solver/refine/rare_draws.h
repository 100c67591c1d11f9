// Draws which of many trials with one small probability succeed. RareDraws
// jumps from one success to the next, so the cost depends on the successes
// alone.

#pragma once

#include "base/random.h"

#include <cmath>
#include <cstdint>

namespace enfilade {

class RareDraws {
 public:
  // Trials 0, ..., trials - 1; 0 < probability < 1.
  RareDraws(uint64_t key, double probability, uint64_t trials)
      : random_(key), probability_(probability), trials_(trials) {
    Jump();
  }

  [[nodiscard]] bool AtEnd() const { return at_ >= trials_; }

  // The trial that succeeded. Requires !AtEnd().
  [[nodiscard]] uint64_t Trial() const { return at_; }

  void Next() {
    ++at_;
    Jump();
  }

 private:
  // All n trials fail if u, uniform in [0, 1), exceeds 1 - (1 - p)^n, which is
  // at most n p. Comparing u with n p mostly decides without a logarithm.
  void Jump() {
    constexpr double kRounding = 1e-9;
    const double u = random_.Next();
    const auto left = static_cast<double>(trials_ - at_);
    if (u > left * probability_ + kRounding) {
      at_ = trials_;
      return;
    }
    const double misses = std::log1p(-u) / std::log1p(-probability_);
    at_ = at_ < trials_ && misses < left ? at_ + static_cast<uint64_t>(misses)
                                         : trials_;
  }

  Random random_;
  double probability_;
  uint64_t trials_;
  uint64_t at_ = 0;
};

}  // namespace enfilade
