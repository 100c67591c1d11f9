// What the solve asked of its cache, in order, whether or not it was in memory:
// what an optimal cache of the same capacity would have read is computed from
// it (store/belady.h), beside what was read and what must be in any case.
//
// Things are trees, geometry, blockers and chunks of links, each with its size
// in memory and what reading it takes. Uses that the optimal cache has in
// memory anyway, since less than its capacity was used since the thing's last
// one, are one long use: so a trace is short, and it takes a fixed amount of
// memory. Where that is too little, what is measured looks ahead no further
// than the trace goes: the cache stays as it is, but knows less of what comes.
// With more things than there is room for, it begins empty now and then.

#pragma once

#include "base/block_storage.h"
#include "store/belady.h"

#include <cstddef>
#include <cstdint>
#include <unordered_map>
#include <vector>

namespace enfilade {

// Something in memory, made of a block.
struct CachedThing {
  BlockKey block;
  uint32_t form = 0;  // which of those that are made of it

  bool operator==(const CachedThing&) const = default;
};

struct HashOfThing {
  size_t operator()(const CachedThing& thing) const noexcept;
};

// Bytes read for the same requests.
struct TracedReads {
  uint64_t read = 0;        // by the solver's cache
  uint64_t belady = 0;      // by the best cache
  uint64_t compulsory = 0;  // by one without a limit
};

class AccessTrace {
 public:
  // `own_bytes`: what the trace itself may take, at most.
  explicit AccessTrace(uint64_t own_bytes);

  // What of a budget a trace should have.
  static uint64_t OwnBytesUnder(uint64_t budget_bytes);

  // What the cache may hold from now on.
  void SetCapacity(uint64_t bytes);

  // A thing is needed until End; it is not in use now. Its sizes: those it has
  // by now.
  void Begin(const CachedThing& thing);

  // Like Begin, for a second thing that comes from the same block as the one
  // just begun; its read is counted once.
  void BeginAlong(const CachedThing& thing);
  void End(const CachedThing& thing);

  // Used for a moment only; need not stay in memory afterwards.
  void Touch(const CachedThing& thing);

  // Made and not read; need not stay in memory either.
  void Make(const CachedThing& thing);

  void SetHeld(const CachedThing& thing, uint64_t bytes);
  void SetStored(const CachedThing& thing, uint64_t bytes);

  // So many bytes of things were read from the store.
  void AddRead(uint64_t bytes) { reads_.read += bytes; }

  // Likewise of what is used only once, where no cache can help.
  void AddReadOnce(uint64_t bytes);

  // The sums since they were asked for last.
  TracedReads TakeReads();

  // The cache is empty again, and nothing is in use.
  void Restart();

  // What it holds now: bounded, however long the solve goes on.
  [[nodiscard]] uint64_t SizeBytes() const;

 private:
  static constexpr uint32_t kNoStep = UINT32_MAX;

  struct Thing {
    CachedBytes now;
    CachedBytes noted;             // what the steps say so far
    uint64_t kept_until = 0;       // `used_bytes_` until which it surely stays
    uint32_t last_step = kNoStep;  // where its use ended, if it has
    bool in_use = false;
  };

  static constexpr uint64_t kThingBytes = 48;

  uint32_t IndexOf(const CachedThing& thing);
  bool BeginUse(uint32_t index);
  void EndUse(uint32_t index, CacheAction action);
  void NoteSizes(uint32_t index);
  void Add(CacheAction action, uint32_t thing);
  void Compact();
  void Play(size_t count);

  size_t most_steps_;
  size_t most_things_;
  std::unordered_map<CachedThing, uint32_t, HashOfThing> index_;
  std::vector<Thing> things_;
  std::vector<CacheStep> steps_;
  std::vector<CachedBytes> sizes_;  // of the steps that have them
  uint64_t capacity_bytes_ = 0;
  bool begin_is_new_ = false;  // the last Begin was a step
  uint64_t used_bytes_ = 0;    // by all uses so far; a measure of time
  uint64_t in_use_bytes_ = 0;  // now
  BeladyCache cache_;
  TracedReads reads_;
};

}  // namespace enfilade
