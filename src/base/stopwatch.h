// Seconds of the steady clock: since a point in time, and within a scope.

#pragma once

#include <chrono>

namespace enfilade {

inline double SecondsSince(std::chrono::steady_clock::time_point begin) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin)
      .count();
}

// Adds the seconds that a scope takes to a counter.
class Stopwatch {
 public:
  explicit Stopwatch(double* seconds)
      : seconds_(seconds), start_(std::chrono::steady_clock::now()) {}

  ~Stopwatch() { *seconds_ += SecondsSince(start_); }

  Stopwatch(const Stopwatch&) = delete;
  Stopwatch& operator=(const Stopwatch&) = delete;

 private:
  double* seconds_;
  std::chrono::steady_clock::time_point start_;
};

}  // namespace enfilade
