// How the time that work takes grows with its size. Seconds are an oracle of
// the machine and of what else it does; the power by which they grow is one of
// the code.

#pragma once

#include <algorithm>
#include <ctime>
#include <limits>

namespace enfilade {

// The processor time of all threads that `work` takes, s: the least of three
// runs, since caches may be cold and cores shared.
template <typename Work>
double CpuSecondsOf(const Work& work) {
  double least = std::numeric_limits<double>::infinity();
  for (int run = 0; run < 3; ++run) {
    const std::clock_t start = std::clock();
    work();
    least = std::min(
        least, static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC);
  }
  return least;
}

}  // namespace enfilade
