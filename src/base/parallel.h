// The only header that includes oneTBB. Rule: compute in parallel, apply in a
// fixed order, so that results have the same bits for every number of threads.

#pragma once

#include <algorithm>
#include <cstddef>

#include <tbb/blocked_range.h>
#include <tbb/global_control.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>
#include <tbb/task_group.h>

namespace enfilade {

// Bounds the threads of the whole process as long as the object lives.
class ThreadLimit {
 public:
  explicit ThreadLimit(size_t threads)
      : control_(tbb::global_control::max_allowed_parallelism, threads) {}

 private:
  tbb::global_control control_;
};

// Like ParallelFor, for a loop inside a call of an outer ParallelFor. A thread
// that waits for this loop may begin further calls of the outer loop: no thread
// idles while there are any, but two outer calls then share one stack.
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
// thread that waits for others takes up work of this loop only. Otherwise, in
// nested loops, it could begin a second call of the outer loop inside the
// first.
template <typename Body>
void ParallelFor(size_t count, const Body& body) {
  tbb::this_task_arena::isolate([&] { ParallelForInside(count, body); });
}

// ParallelFor for short calls: `block` of them, one after the other, are a
// task.
template <typename Body>
void ParallelForInBlocks(size_t count, size_t block, const Body& body) {
  ParallelFor((count + block - 1) / block, [&](size_t task) {
    const size_t end = std::min(count, (task + 1) * block);
    for (size_t i = task * block; i < end; ++i) {
      body(i);
    }
  });
}

// How many threads may work at a time.
inline size_t MostThreads() {
  return static_cast<size_t>(tbb::this_task_arena::max_concurrency());
}

// Calls body() once for each thread that may work. The calls share the items of
// work among themselves: for many small items, a task per item would cost as
// much as the work.
template <typename Body>
void OnAllThreads(const Body& body) {
  ParallelFor(MostThreads(), [&](size_t /*any*/) { body(); });
}

// One call that runs beside what its owner does next. An idle thread makes the
// call; if none is idle, the owner makes it in Wait.
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
      // A destructor must not throw; Wait would have reported the exception.
    }
  }

  template <typename Body>
  void Start(const Body& body) {
    calls_.run(body);
  }

  // Waits for the end of the call, if there is one; rethrows its exception.
  void Wait() { calls_.wait(); }

 private:
  tbb::task_group calls_;
};

// Runs body on the calling thread alone: parallel algorithms inside body, such
// as a library's, use no other thread and take up no task from outside.
template <typename Body>
void RunAlone(const Body& body) {
  tbb::task_arena arena(1, 1);
  arena.execute(body);
}

}  // namespace enfilade
