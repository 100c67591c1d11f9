#include "store/belady.h"

#include "base/random.h"

#include <algorithm>
#include <map>
#include <vector>

#include <gtest/gtest.h>

namespace enfilade {
namespace {

using Trace = std::vector<uint32_t>;
using Sizes = std::vector<uint64_t>;

// The least bytes that any demand-paging policy reads, by trying every set of
// items that could stay after every access.
uint64_t BruteForce(const Trace& trace,
                    const Sizes& sizes,
                    uint64_t capacity_bytes) {
  const auto bytes_of = [&](uint32_t set) {
    uint64_t bytes = 0;
    for (size_t i = 0; i < sizes.size(); ++i) {
      bytes += (set >> i & 1U) != 0 ? sizes[i] : 0;
    }
    return bytes;
  };
  std::map<uint32_t, uint64_t> cost_of_resident{{0, 0}};
  for (const uint32_t item : trace) {
    std::map<uint32_t, uint64_t> next;
    for (const auto& [resident, cost] : cost_of_resident) {
      const bool hit = (resident >> item & 1U) != 0;
      const uint64_t paid = cost + (hit ? 0 : sizes[item]);
      const uint32_t others = resident & ~(1U << item);
      // Every subset of the others that fits beside the item.
      for (uint32_t kept = others;; kept = (kept - 1) & others) {
        const uint32_t set = kept | 1U << item;
        if (bytes_of(set) <= capacity_bytes) {
          const auto [at, added] = next.emplace(set, paid);
          at->second = std::min(at->second, paid);
        }
        if (kept == 0) {
          break;
        }
      }
    }
    cost_of_resident = std::move(next);
  }
  uint64_t least = UINT64_MAX;
  for (const auto& [resident, cost] : cost_of_resident) {
    least = std::min(least, cost);
  }
  return least;
}

Trace RandomTrace(Random& random, size_t length, uint32_t items) {
  Trace trace(length);
  for (auto& item : trace) {
    item = random.NextBelow(items);
  }
  return trace;
}

TEST(Belady, EmptyTraceReadsNothing) {
  const auto reads = MeasureBelady({}, Sizes{5}, 10);
  EXPECT_EQ(reads.optimal_bytes, 0U);
  EXPECT_EQ(reads.compulsory_bytes, 0U);
}

TEST(Belady, EverythingFitsMeansCompulsoryReadsOnly) {
  const auto reads =
      MeasureBelady(Trace{0, 1, 2, 0, 1, 2}, Sizes{10, 20, 30, 40}, 60);
  EXPECT_EQ(reads.compulsory_bytes, 60U);
  EXPECT_EQ(reads.optimal_bytes, 60U);
}

TEST(Belady, CyclicSweepKeepsAllButOneSlot) {
  // Items 0 1 2 in a circle with room for two: after the three first reads,
  // MIN misses every second access: 0 1 2 | 0 hit, 1 miss, 2 hit, 0 miss ...
  const auto reads =
      MeasureBelady(Trace{0, 1, 2, 0, 1, 2, 0, 1, 2}, Sizes{1, 1, 1}, 2);
  EXPECT_EQ(reads.compulsory_bytes, 3U);
  EXPECT_EQ(reads.optimal_bytes, 6U);
}

TEST(Belady, TextbookTraceHasItsNineFaults) {
  // Silberschatz et al., Operating System Concepts: 9 faults with 3 frames.
  const Trace trace{7, 0, 1, 2, 0, 3, 0, 4, 2, 3, 0, 3, 2, 1, 2, 0, 1, 7, 0, 1};
  EXPECT_EQ(MeasureBelady(trace, Sizes(8, 1), 3).optimal_bytes, 9U);
}

TEST(Belady, ItemLargerThanTheCapacityDisplacesNothing) {
  const auto reads = MeasureBelady(Trace{0, 1, 0, 1, 0}, Sizes{2, 100}, 4);
  EXPECT_EQ(reads.compulsory_bytes, 102U);
  EXPECT_EQ(reads.optimal_bytes, 202U);
}

TEST(Belady, UnitSizesReachTheBruteForceOptimum) {
  Random random(1);
  for (int trial = 0; trial < 300; ++trial) {
    const Trace trace = RandomTrace(random, 14, 5);
    const uint64_t capacity = 1 + random.NextBelow(4);
    const Sizes sizes(5, 1);
    EXPECT_EQ(MeasureBelady(trace, sizes, capacity).optimal_bytes,
              BruteForce(trace, sizes, capacity))
        << "trial " << trial;
  }
}

TEST(Belady, AnySizesLieBetweenTheOptimumAndReadingAlways) {
  Random random(2);
  for (int trial = 0; trial < 300; ++trial) {
    const Trace trace = RandomTrace(random, 12, 5);
    Sizes sizes(5);
    uint64_t always = 0;
    for (auto& size : sizes) {
      size = 1 + random.NextBelow(6);
    }
    for (const uint32_t item : trace) {
      always += sizes[item];
    }
    const uint64_t capacity = 6 + random.NextBelow(8);
    const auto reads = MeasureBelady(trace, sizes, capacity);
    EXPECT_GE(reads.optimal_bytes, BruteForce(trace, sizes, capacity));
    EXPECT_GE(reads.optimal_bytes, reads.compulsory_bytes);
    EXPECT_LE(reads.optimal_bytes, always);
  }
}

}  // namespace
}  // namespace enfilade
