#include "base/parallel.h"

#include <atomic>
#include <chrono>
#include <cstddef>
#include <stdexcept>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

namespace enfilade {
namespace {

TEST(OnAllThreads, SharesOutAllThereIsToDo) {
  constexpr size_t kItems = 10000;
  std::vector<std::atomic<int>> done(kItems);
  std::atomic<size_t> next = 0;
  OnAllThreads([&] {
    for (size_t i = next++; i < kItems; i = next++) {
      ++done[i];
    }
  });
  for (const std::atomic<int>& times : done) {
    EXPECT_EQ(times, 1);
  }
}

// Each call waits for another one, which only another thread can make.
TEST(OnAllThreads, HasSeveralAtWorkAtOnce) {
  if (std::thread::hardware_concurrency() < 2) {
    GTEST_SKIP() << "there is one thread";
  }
  const auto give_up = std::chrono::steady_clock::now() +
                       std::chrono::seconds(20);  // on a machine that is busy
  std::atomic<int> calls = 0;
  std::atomic<bool> have_met = false;
  OnAllThreads([&] {
    ++calls;
    while (!have_met && std::chrono::steady_clock::now() < give_up) {
      have_met = calls > 1;
      std::this_thread::yield();
    }
  });
  EXPECT_TRUE(have_met);
}

TEST(CallBeside, IsOverWhenItWasWaitedFor) {
  for (const size_t threads : {size_t{1}, size_t{3}}) {
    const ThreadLimit limit(threads);
    CallBeside beside;
    beside.Wait();  // for nothing
    for (int i = 1; i <= 100; ++i) {
      std::atomic<int> done = 0;
      beside.Start([&] { ++done; });
      // A ParallelFor of the owner neither waits for the task nor begins it.
      ParallelFor(3, [](size_t /*i*/) {});
      beside.Wait();
      EXPECT_EQ(done, 1);
    }
  }
}

TEST(CallBeside, ThrowsWhereItIsWaitedFor) {
  CallBeside beside;
  beside.Start([] { throw std::runtime_error("full"); });
  EXPECT_THROW(beside.Wait(), std::runtime_error);
  beside.Wait();
  std::atomic<int> done = 0;
  {
    CallBeside gone;
    gone.Start([&] {
      ++done;
      throw std::runtime_error("full");
    });
  }
  EXPECT_EQ(done, 1);
}

}  // namespace
}  // namespace enfilade
