// What the best possible cache would have read: the yardstick for paging.
//
// Belady's MIN evicts what is used again last, which is optimal when all things
// have one size. For things of different sizes the optimum is NP-hard (Chrobak
// et al., "Caching is hard", 2012) and the same greedy rule is taken: a
// strong policy that knows the future, though no strict lower bound. The
// compulsory bytes are one.

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
  kBeginAlong,  // one that one read brings in together with the step before:
                // it costs nothing if that was a kBegin that had to read
  kEnd,         // the use ends
  kTouch,       // a use that is over at once, beside what the cache may hold
  kMade,        // the thing is there from now on without being read, or not, as
                // the cache likes; what was kept of it is worth nothing
  kResize,      // the thing has other sizes from now on
  kCapacity,    // the cache has another capacity from now on
};

// Things in one trace, at most.
inline constexpr uint32_t kMostCacheThings = 1U << 28;

// One step of what a cache is asked for.
struct CacheStep {
  CacheStep(CacheAction what, uint32_t with)
      : action(what), thing(with & (kMostCacheThings - 1)) {}

  CacheAction action : 4;
  uint32_t thing : 28;
};

static_assert(sizeof(CacheStep) == sizeof(uint32_t));

// What a thing takes in memory, and what reading it takes.
struct CachedBytes {
  uint64_t held = 0;
  uint64_t stored = 0;

  friend bool operator==(const CachedBytes&, const CachedBytes&) = default;
};

struct BeladyReads {
  uint64_t optimal_bytes = 0;     // read by MIN
  uint64_t compulsory_bytes = 0;  // every thing once, unless it was made
};

// A cache that knows what comes: reads what is used and not in memory, and to
// make room drops what is used again last of what is not in use. It may look
// ahead no further than the steps it is given at a time: what does not occur in
// them goes first.
class BeladyCache {
 public:
  // Takes its memory for so many things at once, and more if there are more.
  explicit BeladyCache(size_t things = 0);

  // Plays the first `count` of the steps and looks at the others. The n-th
  // kResize or kCapacity among them takes the n-th of `sizes`; a capacity is
  // `held`. Memory on top of the cache's own: 4 bytes per step.
  void Play(std::span<const CacheStep> steps,
            size_t count,
            std::span<const CachedBytes> sizes);

  // What was read since this was asked for last.
  BeladyReads TakeReads() { return std::exchange(reads_, {}); }

  // Bytes of the cache's own memory per thing, if it was told how many.
  static constexpr uint64_t kBytesPerThing = 56;

 private:
  struct Thing {
    CachedBytes bytes;
    uint32_t next = 0;  // its next use, where it is not in use
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
  // What may go by its next use, and what could before: a heap.
  std::vector<std::pair<uint32_t, uint32_t>> may_go_;
  uint64_t capacity_bytes_ = 0;
  uint64_t here_bytes_ = 0;
  bool has_just_read_ = false;
  BeladyReads reads_;
};

}  // namespace enfilade
