// What the best possible cache would have read: the yardstick for paging.
//
// Belady's MIN evicts the thing whose next use is farthest away, which is
// optimal when all things have one size. For things of different sizes the
// optimum is NP-hard (Chrobak et al., "Caching is hard", 2012), and the same
// greedy rule is used: a strong policy that knows the future, but no strict
// lower bound. The compulsory bytes are a strict lower bound.

#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace enfilade {

enum class CacheAction : uint8_t {
  kNone,        // nothing happens
  kBegin,       // a use begins: the thing must be in memory until it ends
  kBeginAlong,  // a use begins of a thing that one read brings in together with
                // the step before: free if that was a kBegin that had to read
  kEnd,         // the use ends
  kTouch,       // a use that ends at once and need not fit into the capacity
  kMade,        // the thing was made anew: the cache may keep it without a
                // read; an older copy in the cache is worthless
  kResize,      // the thing has other sizes from now on
  kCapacity,    // the cache has another capacity from now on
};

// The most things that one trace may have.
inline constexpr uint32_t kMostCacheThings = 1U << 28;

// One step of the trace of requests to a cache.
struct CacheStep {
  CacheStep(CacheAction what, uint32_t with)
      : action(what), thing(with & (kMostCacheThings - 1)) {}

  CacheAction action : 4;
  uint32_t thing : 28;
};

static_assert(sizeof(CacheStep) == sizeof(uint32_t));

// The bytes that a thing takes in memory, and the bytes read to load it.
struct CachedBytes {
  uint64_t held = 0;
  uint64_t stored = 0;

  friend bool operator==(const CachedBytes&, const CachedBytes&) = default;
};

struct BeladyReads {
  uint64_t optimal_bytes = 0;     // read by MIN
  uint64_t compulsory_bytes = 0;  // every thing read once, unless made
};

// A cache that knows the future. The cache reads a thing that is used and not
// in memory; to make room, the cache drops among the things not in use the one
// whose next use is farthest away. The cache looks ahead no further than the
// steps of one call of Play: things that do not occur in these steps go first.
class BeladyCache {
 public:
  // Allocates memory for so many things now, and more if more things come.
  explicit BeladyCache(size_t things = 0);

  // Plays the first `count` steps and uses the others to look ahead only. The
  // n-th kResize or kCapacity takes the n-th of `sizes`; a capacity is its
  // `held`. Memory on top of the cache's own: 4 bytes per step.
  void Play(std::span<const CacheStep> steps,
            size_t count,
            std::span<const CachedBytes> sizes);

  // What was read since the last call.
  BeladyReads TakeReads() { return std::exchange(reads_, {}); }

  // Bytes of the cache's own memory per thing announced to the constructor.
  static constexpr uint64_t kBytesPerThing = 56;

 private:
  struct Thing {
    CachedBytes bytes;
    uint32_t next = 0;  // the next use; valid while not in use
    bool is_here = false;
    bool in_use = false;
    bool was_here = false;
  };

  void Prepare(std::span<const CacheStep> steps);
  void Apply(const CacheStep& step, uint32_t next);
  bool Bring(uint32_t index, bool is_free);
  void Keep(uint32_t index, uint32_t next);
  void Lose(uint32_t index);
  void Shrink();

  std::vector<Thing> things_;
  // A heap, by next use, of things that may go; some entries are stale.
  std::vector<std::pair<uint32_t, uint32_t>> may_go_;
  uint64_t capacity_bytes_ = 0;
  uint64_t here_bytes_ = 0;
  bool has_just_read_ = false;
  BeladyReads reads_;
};

}  // namespace enfilade
