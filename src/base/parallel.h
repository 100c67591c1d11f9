// The one header of oneTBB. Rule: compute in parallel, apply in a fixed order,
// so that results have the same bits for every number of threads.

#pragma once

#include <cstddef>

#include <tbb/blocked_range.h>
#include <tbb/global_control.h>
#include <tbb/parallel_for.h>

namespace enfilade {

// Bounds the worker threads of the whole process while it lives.
class ThreadLimit {
 public:
  explicit ThreadLimit(size_t threads)
      : control_(tbb::global_control::max_allowed_parallelism, threads) {}

 private:
  tbb::global_control control_;
};

// Calls body(i) for every i in [0, count), in any order and in parallel. The
// calls must not depend on each other; an exception of a call is rethrown.
template <typename Body>
void ParallelFor(size_t count, const Body& body) {
  tbb::parallel_for(
      tbb::blocked_range<size_t>(0, count, 1),
      [&](const tbb::blocked_range<size_t>& range) {
        for (size_t i = range.begin(); i < range.end(); ++i) {
          body(i);
        }
      },
      tbb::simple_partitioner());
}

}  // namespace enfilade
