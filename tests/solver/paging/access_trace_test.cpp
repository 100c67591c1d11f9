#include "solver/paging/access_trace.h"

#include "base/random.h"

#include <algorithm>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace enfilade {
namespace {

constexpr uint64_t kOwnBytes = 512 << 10;

CachedThing TreeOf(uint32_t cell) {
  return {{BlockKind::kCellTree, cell}};
}

// A solve whose cells are all in memory reads nothing for hours.
TEST(AccessTrace, StaysSmallHoweverOftenAThingIsUsed) {
  AccessTrace trace(kOwnBytes);
  trace.SetCapacity(1000);
  for (uint32_t i = 0; i < 1'000'000; ++i) {
    trace.Begin(TreeOf(i % 2), {300, 100});
    trace.End(TreeOf(i % 2));
  }
  EXPECT_LE(trace.SizeBytes(), kOwnBytes + 10'000);
  const TracedReads reads = trace.TakeReads();
  EXPECT_EQ(reads.belady, 200U);
  EXPECT_EQ(reads.compulsory, 200U);
}

// A solve that keeps reading new blocks reads each of them once, whatever is
// kept.
TEST(AccessTrace, StaysSmallHoweverManyThingsThereAre) {
  AccessTrace trace(kOwnBytes);
  trace.SetCapacity(1 << 20);
  constexpr uint32_t kBlocks = 300'000;
  uint64_t most = 0;
  for (uint32_t i = 0; i < kBlocks; ++i) {
    const CachedThing links = {{BlockKind::kLinks, i}};
    trace.Touch(links, {20, 10});
    most = std::max(most, trace.SizeBytes());
  }
  EXPECT_LE(most, kOwnBytes + 10'000);
  const TracedReads reads = trace.TakeReads();
  EXPECT_EQ(reads.belady, 10U * kBlocks);
  EXPECT_EQ(reads.compulsory, 10U * kBlocks);
}

TEST(AccessTrace, ForgetsWhatItHasSaid) {
  AccessTrace trace(kOwnBytes);
  trace.SetCapacity(100);
  trace.Touch(TreeOf(0), {10, 5});
  trace.AddRead(7);
  trace.AddReadOnce(2);
  const TracedReads reads = trace.TakeReads();
  EXPECT_EQ(reads.read, 9U);
  EXPECT_EQ(reads.belady, 7U);
  EXPECT_EQ(reads.compulsory, 7U);
  trace.Touch(TreeOf(0), {10, 5});
  EXPECT_EQ(trace.TakeReads().belady, 0U) << "it is still in memory";
  trace.Restart();
  trace.Touch(TreeOf(0), {10, 5});
  EXPECT_EQ(trace.TakeReads().belady, 5U) << "all was forgotten";
}

// A thing costs what it takes now, not what it took when it was seen first: a
// tree that has grown, or one that was in memory when the trace began anew.
TEST(AccessTrace, TakesTheSizesOfEachUse) {
  AccessTrace trace(kOwnBytes);
  trace.SetCapacity(100);
  trace.Begin(TreeOf(0), {10, 5});
  trace.Resize(TreeOf(0), 60);
  trace.Restart();
  trace.End(TreeOf(0));
  trace.Resize(TreeOf(0), 70);  // of the time before: not known any more
  trace.Begin(TreeOf(0), {60, 30});
  trace.End(TreeOf(0));
  trace.Begin(TreeOf(1), {70, 1});  // drives the tree out
  trace.End(TreeOf(1));
  trace.Begin(TreeOf(0), {60, 30});
  trace.End(TreeOf(0));
  EXPECT_EQ(trace.TakeReads().belady, 5U + 30 + 1 + 30);
}

// A random sequence of uses, some inside others, that is told to a trace and,
// step by step, to the cache itself.
struct Play {
  std::vector<CacheStep> steps;
  std::vector<CachedBytes> sizes;
  std::vector<CachedBytes> of_things;

  void AddThing(CachedBytes bytes) {
    steps.emplace_back(CacheAction::kResize,
                       static_cast<uint32_t>(of_things.size()));
    sizes.push_back(bytes);
    of_things.push_back(bytes);
  }

  void Capacity(uint64_t bytes, AccessTrace* trace) {
    steps.emplace_back(CacheAction::kCapacity, 0);
    sizes.push_back({bytes, 0});
    trace->SetCapacity(bytes);
  }
};

// Uses of 12 things with room for some; returns the measure of all steps as
// they are, then the trace's own measure.
std::pair<BeladyReads, BeladyReads> Compare(uint64_t seed,
                                            uint64_t own_bytes,
                                            uint64_t most_bytes) {
  Random random(seed);
  constexpr uint32_t kThings = 12;
  AccessTrace trace(own_bytes);
  Play play;
  play.Capacity(4 * most_bytes, &trace);
  for (uint32_t i = 0; i < kThings; ++i) {
    const auto draw = [&] {
      return most_bytes / 2 + 1 +
             random.NextBelow(static_cast<uint32_t>(most_bytes / 2));
    };
    play.AddThing({draw(), draw()});
  }
  std::vector<bool> in_use(kThings, false);
  size_t uses = 0;
  for (int i = 0; i < 600; ++i) {
    // Things near the current place are used more often, as blockers are.
    const uint32_t thing = (static_cast<uint32_t>(i) / 40 +
                            random.NextBelow(3) + random.NextBelow(4)) %
                           kThings;
    if (random.NextBelow(3) == 0 && !in_use[thing]) {
      play.steps.emplace_back(CacheAction::kTouch, thing);
      trace.Touch(TreeOf(thing), play.of_things[thing]);
    } else if (in_use[thing]) {
      play.steps.emplace_back(CacheAction::kEnd, thing);
      trace.End(TreeOf(thing));
      --uses;
      in_use[thing] = false;
    } else if (uses < 3) {
      play.steps.emplace_back(CacheAction::kBegin, thing);
      trace.Begin(TreeOf(thing), play.of_things[thing]);
      ++uses;
      in_use[thing] = true;
    }
  }
  BeladyCache cache;
  cache.Play(play.steps, play.steps.size(), play.sizes);
  const TracedReads reads = trace.TakeReads();
  return {cache.TakeReads(), {reads.belady, reads.compulsory}};
}

// Uses that the trace leaves out change nothing in what it measures.
TEST(AccessTrace, MeasuresAsIfAllUsesWereNoted) {
  for (uint64_t seed = 1; seed <= 300; ++seed) {
    const auto [whole, traced] = Compare(seed, kOwnBytes, 16);
    EXPECT_EQ(traced.optimal_bytes, whole.optimal_bytes) << "seed " << seed;
    EXPECT_EQ(traced.compulsory_bytes, whole.compulsory_bytes);
  }
}

// A trace too short for all uses looks less far ahead and reads no less.
TEST(AccessTrace, ShortTracesReadNoLessAndLittleMore) {
  constexpr uint64_t kShort = 100;
  uint64_t whole_bytes = 0;
  uint64_t traced_bytes = 0;
  for (uint64_t seed = 1; seed <= 100; ++seed) {
    const auto [whole, traced] = Compare(seed, kShort, 2);
    EXPECT_GE(traced.optimal_bytes, whole.optimal_bytes) << "seed " << seed;
    EXPECT_EQ(traced.compulsory_bytes, whole.compulsory_bytes);
    whole_bytes += whole.optimal_bytes;
    traced_bytes += traced.optimal_bytes;
  }
  EXPECT_GT(traced_bytes, whole_bytes) << "it is not short";
  EXPECT_LE(static_cast<double>(traced_bytes),
            1.1 * static_cast<double>(whole_bytes));
}

// One read brings both blockers of a cell, unless one of them is in memory.
TEST(AccessTrace, WhatComesAlongCostsOneRead) {
  AccessTrace trace(kOwnBytes);
  trace.SetCapacity(100);
  const CachedThing shafts = {{BlockKind::kCellPatches, 0}, 1};
  const CachedThing rays = {{BlockKind::kCellPatches, 0}, 2};
  constexpr CachedBytes kBytes{30, 5};
  trace.Begin(shafts, kBytes);
  trace.BeginAlong(rays, kBytes);
  EXPECT_EQ(trace.TakeReads().belady, 5U);
  trace.End(rays);
  trace.End(shafts);
  trace.Touch(TreeOf(1), {60, 0});
  trace.Begin(TreeOf(2), {100, 0});
  trace.End(TreeOf(2));
  trace.Begin(shafts, kBytes);
  trace.BeginAlong(rays, kBytes);
  EXPECT_EQ(trace.TakeReads().belady, 5U);
}

}  // namespace
}  // namespace enfilade
