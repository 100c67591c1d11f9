// Records in order what the solve asks of its cache, whether or not it is in
// memory. From the record follows what an optimal cache of the same capacity
// would have read (store/belady.h), beside what was read and what any cache
// must read.
//
// Things are trees, geometry, blockers and chunks of links, each with its size
// in memory and the bytes that reading it takes. If less than the capacity was
// used since the last use of a thing, the optimal cache still has the thing in
// memory, and the trace joins the two uses into one long use. A trace is
// therefore short, and it takes a fixed amount of memory. If that memory is too
// little, the simulated optimal cache looks ahead no further than the trace
// goes: it keeps its contents but knows less of what comes. If there are more
// things than the trace has room for, the simulated cache starts empty again.

#pragma once

#include "base/block_storage.h"
#include "store/belady.h"

#include <cstddef>
#include <cstdint>
#include <unordered_map>
#include <vector>

namespace enfilade {

// Something in memory that is made from a block.
struct CachedThing {
  BlockKey block;
  uint32_t form = 0;  // tells apart the things made from one block

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
  // `own_bytes`: the most bytes that the trace itself may take.
  explicit AccessTrace(uint64_t own_bytes);

  // The bytes that a trace should have under a budget.
  static uint64_t OwnBytesUnder(uint64_t budget_bytes);

  // Sets the bytes that the cache may hold from now on.
  void SetCapacity(uint64_t bytes);

  // A use of a thing begins and lasts until End. Requires that the thing is not
  // in use.
  void Begin(const CachedThing& thing, CachedBytes bytes);

  // Like Begin, for a second thing that comes from the same block as the one
  // just begun; its read is counted once.
  void BeginAlong(const CachedThing& thing, CachedBytes bytes);

  // Allocates nothing unless hundreds of uses end in a row; may be called where
  // exceptions are not allowed.
  void End(const CachedThing& thing);

  // A thing is used for a moment only and need not stay in memory afterwards.
  void Touch(const CachedThing& thing, CachedBytes bytes);

  // A thing was made and not read; it need not stay in memory either.
  void Make(const CachedThing& thing, CachedBytes bytes);

  // A thing in use takes this many bytes in memory from now on.
  void Resize(const CachedThing& thing, uint64_t held_bytes);

  // The solver's cache has read this many bytes of things from the store.
  void AddRead(uint64_t bytes) { reads_.read += bytes; }

  // The same for bytes that are used only once, where no cache can help.
  void AddReadOnce(uint64_t bytes);

  // Returns the sums since the last call.
  TracedReads TakeReads();

  // The cache is empty again, and nothing is in use.
  void Restart();

  // The bytes that the trace holds now: bounded, however long the solve goes
  // on.
  [[nodiscard]] uint64_t SizeBytes() const;

 private:
  static constexpr uint32_t kNoStep = UINT32_MAX;

  struct Thing {
    CachedBytes now;
    CachedBytes noted;             // the sizes that the steps have so far
    uint64_t kept_until = 0;       // stays while `used_bytes_` is at most this
    uint32_t last_step = kNoStep;  // the step that ended its last use
    bool in_use = false;
  };

  static constexpr uint64_t kThingBytes = 48;

  uint32_t IndexOf(const CachedThing& thing, CachedBytes bytes);
  bool BeginUse(uint32_t index);
  void EndUse(uint32_t index, CacheAction action);
  void NoteSizes(uint32_t index);
  void Append(CacheAction action, uint32_t thing);
  void MakeRoom();
  void Compact();
  void Play(size_t count);

  size_t most_steps_;
  size_t most_things_;
  std::unordered_map<CachedThing, uint32_t, HashOfThing> index_;
  std::vector<Thing> things_;
  std::vector<CacheStep> steps_;
  std::vector<CachedBytes> sizes_;  // of kResize and kCapacity steps
  uint64_t capacity_bytes_ = 0;
  bool begin_is_new_ = false;  // the last Begin added a step
  uint64_t used_bytes_ = 0;    // by all uses so far; a measure of time
  uint64_t in_use_bytes_ = 0;  // of the things in use now
  BeladyCache cache_;
  TracedReads reads_;
};

}  // namespace enfilade
