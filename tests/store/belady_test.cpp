#include "store/belady.h"

#include "base/random.h"

#include <algorithm>
#include <map>
#include <span>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace enfilade {
namespace {

using Trace = std::vector<uint32_t>;
using Sizes = std::vector<CachedBytes>;

// Things of which each takes one byte, in memory and to read.
Sizes Units(size_t things) {
  return Sizes(things, {1, 1});
}

// A script of steps that begins with the capacity and the sizes.
struct Script {
  std::vector<CacheStep> steps;
  std::vector<CachedBytes> sizes;

  Script(const Sizes& things, uint64_t capacity_bytes) {
    steps.emplace_back(CacheAction::kCapacity, 0);
    sizes.push_back({capacity_bytes, 0});
    for (uint32_t i = 0; i < things.size(); ++i) {
      steps.emplace_back(CacheAction::kResize, i);
      sizes.push_back(things[i]);
    }
  }

  void Add(CacheAction action, uint32_t thing) {
    steps.emplace_back(action, thing);
  }

  [[nodiscard]] BeladyReads Play() const {
    BeladyCache cache;
    cache.Play(steps, steps.size(), sizes);
    return cache.TakeReads();
  }
};

// Uses one after the other.
Script ScriptOf(const Trace& trace, const Sizes& sizes, uint64_t capacity) {
  Script script(sizes, capacity);
  for (const uint32_t thing : trace) {
    script.Add(CacheAction::kBegin, thing);
    script.Add(CacheAction::kEnd, thing);
  }
  return script;
}

BeladyReads Measure(const Trace& trace, const Sizes& sizes, uint64_t capacity) {
  return ScriptOf(trace, sizes, capacity).Play();
}

// The least that was read to have a set of things, given as bits, in memory.
using Costs = std::map<uint32_t, uint64_t>;

uint64_t HeldBytes(uint32_t set, const Sizes& sizes) {
  uint64_t bytes = 0;
  for (size_t i = 0; i < sizes.size(); ++i) {
    bytes += (set >> i & 1U) != 0 ? sizes[i].held : 0;
  }
  return bytes;
}

// Lets every subset of `here` stay that fits beside what is in use.
void LetStay(uint32_t here, uint32_t in_use, uint64_t paid, Costs* costs) {
  const uint32_t others = here & ~in_use;
  for (uint32_t kept = others;; kept = (kept - 1) & others) {
    const auto [at, added] = costs->emplace(kept | in_use, paid);
    at->second = std::min(at->second, paid);
    if (kept == 0) {
      return;
    }
  }
}

// The least bytes that any demand-paging policy reads, by trying every set of
// things that could stay after every step.
uint64_t BruteForce(const Script& script,
                    const Sizes& sizes,
                    uint64_t capacity_bytes) {
  Costs costs{{0, 0}};
  uint32_t in_use = 0;
  for (const CacheStep& step : script.steps) {
    const uint32_t bit = 1U << step.thing;
    in_use &= step.action == CacheAction::kEnd ? ~bit : ~0U;
    if (step.action != CacheAction::kBegin) {
      continue;
    }
    in_use |= bit;
    Costs next;
    for (const auto& [here, cost] : costs) {
      const bool is_hit = (here & bit) != 0;
      LetStay(
          here, in_use, cost + (is_hit ? 0 : sizes[step.thing].stored), &next);
    }
    std::erase_if(next, [&](const auto& entry) {
      return HeldBytes(entry.first, sizes) > capacity_bytes;
    });
    costs = std::move(next);
  }
  uint64_t least = UINT64_MAX;
  for (const auto& [here, cost] : costs) {
    least = std::min(least, cost);
  }
  return least;
}

Trace RandomTrace(Random& random, size_t length, uint32_t things) {
  Trace trace(length);
  for (auto& thing : trace) {
    thing = random.NextBelow(things);
  }
  return trace;
}

TEST(Belady, EmptyTraceReadsNothing) {
  const auto reads = Measure({}, Units(1), 10);
  EXPECT_EQ(reads.optimal_bytes, 0U);
  EXPECT_EQ(reads.compulsory_bytes, 0U);
}

TEST(Belady, EverythingFitsMeansCompulsoryReadsOnly) {
  const Sizes sizes = {{10, 1}, {20, 2}, {30, 3}, {40, 4}};
  const auto reads = Measure({0, 1, 2, 0, 1, 2}, sizes, 60);
  EXPECT_EQ(reads.compulsory_bytes, 6U);
  EXPECT_EQ(reads.optimal_bytes, 6U);
}

// A thing takes more bytes in memory than it takes to read.
TEST(Belady, SizesInMemoryDecideWhatFits) {
  const Sizes sizes = {{10, 1}, {10, 1}};
  EXPECT_EQ(Measure({0, 1, 0, 1}, sizes, 20).optimal_bytes, 2U);
  EXPECT_EQ(Measure({0, 1, 0, 1}, sizes, 19).optimal_bytes, 4U);
}

TEST(Belady, CyclicSweepKeepsAllButOneSlot) {
  // Things 0 1 2 in a circle with room for two: after the three first reads,
  // MIN misses every second access: 0 1 2 | 0 hit, 1 miss, 2 hit, 0 miss ...
  const auto reads = Measure({0, 1, 2, 0, 1, 2, 0, 1, 2}, Units(3), 2);
  EXPECT_EQ(reads.compulsory_bytes, 3U);
  EXPECT_EQ(reads.optimal_bytes, 6U);
}

TEST(Belady, TextbookTraceHasItsNineFaults) {
  // Silberschatz et al., Operating System Concepts: 9 faults with 3 frames.
  const Trace trace{7, 0, 1, 2, 0, 3, 0, 4, 2, 3, 0, 3, 2, 1, 2, 0, 1, 7, 0, 1};
  EXPECT_EQ(Measure(trace, Units(8), 3).optimal_bytes, 9U);
}

TEST(Belady, ThingLargerThanTheCapacityIsReadAtEachTouch) {
  Script script({{2, 2}, {100, 100}}, 4);
  for (const uint32_t thing : {0U, 1U, 0U, 1U, 0U}) {
    script.Add(CacheAction::kTouch, thing);
  }
  EXPECT_EQ(script.Play().compulsory_bytes, 102U);
  EXPECT_EQ(script.Play().optimal_bytes, 202U);
}

// A touch needs no room: things that are used sooner stay.
TEST(Belady, TouchDisplacesNothingThatComesSooner) {
  Script script(Units(2), 1);
  for (const uint32_t thing : {0U, 1U, 0U, 0U, 1U}) {
    script.Add(CacheAction::kTouch, thing);
  }
  EXPECT_EQ(script.Play().optimal_bytes, 3U);
}

TEST(Belady, WhatIsInUseStays) {
  Script script(Units(3), 2);
  script.Add(CacheAction::kBegin, 0);
  for (const uint32_t thing : {1U, 2U, 1U, 2U}) {
    script.Add(CacheAction::kBegin, thing);
    script.Add(CacheAction::kEnd, thing);
  }
  script.Add(CacheAction::kEnd, 0);
  EXPECT_EQ(script.Play().optimal_bytes, 5U);
}

TEST(Belady, WhatWasMadeIsReadOnlyIfItCouldNotStay) {
  for (const uint64_t capacity : {1U, 2U}) {
    Script script(Units(2), capacity);
    script.Add(CacheAction::kMade, 0);
    script.Add(CacheAction::kBegin, 1);
    script.Add(CacheAction::kEnd, 1);
    script.Add(CacheAction::kTouch, 0);
    EXPECT_EQ(script.Play().optimal_bytes, capacity == 1 ? 2U : 1U);
    EXPECT_EQ(script.Play().compulsory_bytes, 1U);
  }
}

TEST(Belady, OneReadBringsInWhatComesAlong) {
  for (const auto action : {CacheAction::kBegin, CacheAction::kBeginAlong}) {
    Script script(Units(2), 2);
    script.Add(CacheAction::kBegin, 0);
    script.Add(action, 1);
    EXPECT_EQ(script.Play().optimal_bytes,
              action == CacheAction::kBegin ? 2U : 1U);
  }
}

TEST(Belady, LessRoomOrLargerThingsDropWhatIsUsedLast) {
  Script script(Units(2), 2);
  script.Add(CacheAction::kTouch, 0);
  script.Add(CacheAction::kTouch, 1);
  script.Add(CacheAction::kResize, 1);
  script.sizes.push_back({2, 1});
  script.Add(CacheAction::kTouch, 1);
  script.Add(CacheAction::kCapacity, 0);
  script.sizes.push_back({1, 0});
  script.Add(CacheAction::kTouch, 0);
  EXPECT_EQ(script.Play().optimal_bytes, 3U);
}

TEST(Belady, UnitSizesReachTheBruteForceOptimum) {
  Random random(1);
  for (int trial = 0; trial < 300; ++trial) {
    const Trace trace = RandomTrace(random, 14, 5);
    const uint64_t capacity = 1 + random.NextBelow(4);
    const Script script = ScriptOf(trace, Units(5), capacity);
    EXPECT_EQ(script.Play().optimal_bytes,
              BruteForce(script, Units(5), capacity))
        << "trial " << trial;
  }
}

// Things that stay in use while others come and go.
TEST(Belady, UsesThatLastReachTheBruteForceOptimum) {
  Random random(3);
  for (int trial = 0; trial < 300; ++trial) {
    const uint64_t capacity = 2 + random.NextBelow(3);
    Script script(Units(6), capacity);
    std::vector<uint32_t> in_use;
    for (int i = 0; i < 20; ++i) {
      const uint32_t thing = random.NextBelow(6);
      const auto at = std::find(in_use.begin(), in_use.end(), thing);
      if (at != in_use.end()) {
        script.Add(CacheAction::kEnd, thing);
        in_use.erase(at);
      } else if (in_use.size() < capacity) {
        script.Add(CacheAction::kBegin, thing);
        in_use.push_back(thing);
      }
    }
    EXPECT_EQ(script.Play().optimal_bytes,
              BruteForce(script, Units(6), capacity))
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
      size = {1 + random.NextBelow(6), 1 + random.NextBelow(6)};
    }
    for (const uint32_t thing : trace) {
      always += sizes[thing].stored;
    }
    const uint64_t capacity = 6 + random.NextBelow(8);
    const Script script = ScriptOf(trace, sizes, capacity);
    const auto reads = script.Play();
    EXPECT_GE(reads.optimal_bytes, BruteForce(script, sizes, capacity));
    EXPECT_GE(reads.optimal_bytes, reads.compulsory_bytes);
    EXPECT_LE(reads.optimal_bytes, always);
  }
}

// A trace that is played piece by piece, each with a look ahead of a round.
TEST(Belady, ARoundAheadIsFarEnough) {
  constexpr uint32_t kThings = 20;
  Trace trace;
  for (uint32_t i = 0; i < 8 * kThings; ++i) {
    trace.push_back(i % kThings);
  }
  const Sizes sizes = Units(kThings);
  const Script whole = ScriptOf(trace, sizes, 7);
  BeladyCache cache;
  const size_t prefix = whole.sizes.size();
  cache.Play(whole.steps, prefix, whole.sizes);
  const size_t piece = 2 * kThings;
  for (size_t at = prefix; at < whole.steps.size(); at += piece) {
    const auto rest = std::span(whole.steps).subspan(at);
    cache.Play(rest.first(std::min(2 * piece, rest.size())), piece, {});
  }
  EXPECT_EQ(cache.TakeReads().optimal_bytes, whole.Play().optimal_bytes);
}

}  // namespace
}  // namespace enfilade
