// The one header of oneTBB. Rule: compute in parallel, apply in a fixed order,
// so that results have the same bits for every number of threads.

#pragma once

#include <cstddef>

#include <tbb/blocked_range.h>
#include <tbb/global_control.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>
#include <tbb/task_group.h>

namespace enfilade {

// Bounds the worker threads of the whole process while it lives.
class ThreadLimit {
 public:
  explicit ThreadLimit(size_t threads)
      : control_(tbb::global_control::max_allowed_parallelism, threads) {}

 private:
  tbb::global_control control_;
};

// As ParallelFor, in a call of another one, of which a thread that waits may
// begin more calls: none idles while there are any, but one is then on top of
// the other.
template <typename Body>
void ParallelForInside(size_t count, const Body& body) {
  tbb::parallel_for(
      tbb::blocked_range<size_t>(0, count, 1),
      [&](const tbb::blocked_range<size_t>& range) {
        for (size_t i = range.begin(); i < range.end(); ++i) {
          body(i);
        }
      },
      tbb::simple_partitioner());
}

// Calls body(i) for every i in [0, count), in any order and in parallel. The
// calls must not depend on each other; an exception of a call is rethrown. A
// thread that waits for others does work of this loop only: in a loop within a
// loop it would begin one call of the outer one on top of the other.
template <typename Body>
void ParallelFor(size_t count, const Body& body) {
  tbb::this_task_arena::isolate([&] { ParallelForInside(count, body); });
}

// Calls body() on as many threads as may work, for calls that share out between
// them what there is to do: where that is much and each of it little, a task
// for each would cost as much as the work.
template <typename Body>
void OnAllThreads(const Body& body) {
  const int threads = tbb::this_task_arena::max_concurrency();
  ParallelFor(static_cast<size_t>(threads), [&](size_t /*any*/) { body(); });
}

// One call that goes on beside what its owner does next, on another thread
// where one has nothing to do; else the owner makes it while it waits.
class CallBeside {
 public:
  CallBeside() = default;
  CallBeside(const CallBeside&) = delete;
  CallBeside& operator=(const CallBeside&) = delete;

  // An exception of the call is lost.
  ~CallBeside() {
    try {
      calls_.wait();
    } catch (...) {
      // Its owner is going, for this reason or another.
    }
  }

  template <typename Body>
  void Start(const Body& body) {
    calls_.run(body);
  }

  // Until the call is over, if there is one; rethrows its exception.
  void Wait() { calls_.wait(); }

 private:
  tbb::task_group calls_;
};

// Runs body on the calling thread alone: parallel algorithms inside it (those
// of a library, say) use no other thread, and take up no task from outside.
template <typename Body>
void RunAlone(const Body& body) {
  tbb::task_arena arena(1, 1);
  arena.execute(body);
}

}  // namespace enfilade
