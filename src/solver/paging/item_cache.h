// Things in memory under the budget. Each can be read or made again, so that it
// is evicted when memory is short and nobody uses it: what is needed last goes
// first (next_use.h). What was changed is written back before it goes.

#pragma once

#include "base/block_storage.h"
#include "base/memory.h"
#include "solver/paging/access_trace.h"
#include "solver/paging/item_key.h"
#include "solver/paging/next_use.h"

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

namespace enfilade {

// For one thread at a time. What it returns is in use, valid and in memory as
// long as the pointer is held, which must not outlive the cache.
class ItemCache {
 public:
  // Writes an item back and returns the bytes that it takes in the store. May
  // be called from any thread.
  using Save = std::function<uint64_t(const ItemKey&, const void* value)>;

  // What an item takes.
  struct Bytes {
    uint64_t held = 0;     // in memory
    uint64_t charged = 0;  // of these, by the caller, for the item
    uint64_t stored = 0;   // that were read to make it
  };

  // Order and budget must outlive the cache.
  ItemCache(const NextUse& order, MemoryBudget& budget, Save save);
  ~ItemCache();
  ItemCache(const ItemCache&) = delete;
  ItemCache& operator=(const ItemCache&) = delete;

  // ---- items

  [[nodiscard]] bool Has(const ItemKey& key) const {
    return items_.contains(key);
  }

  // The bytes that an item holds; 0 if it is not in memory.
  [[nodiscard]] uint64_t HeldBytes(const ItemKey& key) const;

  // An item in memory, now in use; null if it is not in memory.
  template <typename T>
  std::shared_ptr<T> Use(const ItemKey& key) {
    return std::static_pointer_cast<T>(UseItem(key, false));
  }

  // The same for an item that is made from the same block as the one just used.
  template <typename T>
  std::shared_ptr<T> UseAlong(const ItemKey& key) {
    return std::static_pointer_cast<T>(UseItem(key, true));
  }

  // The same for an item that is not in use and is used for a moment only:
  // valid until the cache is used again.
  template <typename T>
  const T* UseBriefly(const ItemKey& key) {
    return static_cast<const T*>(UseItemBriefly(key));
  }

  // An item that is in use; `what` names it to the programmer.
  template <typename T>
  const T& InUse(const ItemKey& key, std::string_view what) {
    return *static_cast<const T*>(Changing(key, what)->second.value.get());
  }

  // Takes an item that is not in memory yet, after its charge.
  void Insert(const ItemKey& key, std::shared_ptr<void> value, Bytes bytes);

  // The same for an item that was made and is not in the store yet.
  void InsertChanged(const ItemKey& key,
                     std::shared_ptr<void> value,
                     Bytes bytes);

  // Takes an item that need not be kept, with its charge, if there is room for
  // it without evicting anything that is needed earlier. Where there was none,
  // none is sought again in the same turn: a search looks at all items, and
  // nearly all links are needed later than what is in memory already.
  void InsertIfPossible(const ItemKey& key,
                        std::shared_ptr<void> value,
                        Bytes bytes);

  // An item in use was changed and takes `bytes` now; `what` names it to the
  // budget. It will be written back.
  void MarkChanged(const ItemKey& key, uint64_t bytes, std::string_view what);

  // An item in use takes `bytes` now, and what is new in it can be made again.
  void Resize(const ItemKey& key, uint64_t bytes, std::string_view what);

  // Drops an item, if it is in memory, and does not write it back. The item
  // must not be in use.
  void Forget(const ItemKey& key);
  void ForgetAllLinks();

  // Writes all changed items to the store.
  void Flush();

  // Evicts all that is not in use; the trace begins anew as well.
  void EvictAll();

  // ---- room

  // Evicts until `bytes` can be charged, and charges them. Throws
  // DoesNotFitError, naming the least cap, if that is impossible.
  void MakeRoom(uint64_t bytes, std::string_view what);

  // Like MakeRoom, for working memory that the caller holds for a while.
  MemoryCharge Reserve(uint64_t bytes, std::string_view what);

  // Like Reserve, but charges and evicts nothing if there is no room: for
  // memory that is held for a moment and that FindLeastMemory does not count.
  MemoryCharge ReserveIfPossible(uint64_t bytes, std::string_view what);

  // Whether `bytes` could be charged if all were evicted that is not in use.
  [[nodiscard]] bool CanFree(uint64_t bytes) const;

  // Evicts while the memory of the process itself comes near the cap, whatever
  // was charged. To be called between steps of work that allocates memory.
  void HoldResident(uint64_t coming_bytes = 0);

  // What eviction could not achieve in the last turn is tried again.
  void StartTurn();

  // ---- reads

  // The record of what was asked for; other readers of the store may add to it.
  AccessTrace& Trace() { return trace_; }

  // A thing that need not stay in memory was used, or was made. Its reading is
  // counted by the caller.
  void NoteUse(const ItemKey& key, Bytes bytes);
  void NoteMade(const ItemKey& key, Bytes bytes);

 private:
  struct Item {
    std::shared_ptr<void> value;
    std::weak_ptr<void> use;  // what callers hold, if any do
    Bytes bytes;
    uint64_t last_use = 0;
    bool is_changed = false;
  };

  using Items = std::map<ItemKey, Item>;

  // The item that is needed last and not in use, with the time of its next use.
  // Among items with the same next use, the least recently used one is the
  // victim.
  struct Victim {
    Items::iterator item;
    bool exists = false;
    std::pair<uint64_t, uint64_t> rank;
  };

  static bool GoesLater(const Victim& a, const Victim& b) {
    return std::pair(a.exists, a.rank) < std::pair(b.exists, b.rank);
  }

  std::shared_ptr<void> UseItem(const ItemKey& key, bool is_along);
  const void* UseItemBriefly(const ItemKey& key);
  void SetHeld(const ItemKey& key, Item* item, uint64_t bytes);
  Items::iterator Changing(const ItemKey& key, std::string_view what);
  void Recharge(Items::iterator item, uint64_t bytes, std::string_view what);
  void WriteBack(Items::iterator item, uint64_t stored_bytes);
  void Drop(Items::iterator item);
  void NoteCapacity();

  [[nodiscard]] uint64_t NextUseOf(const ItemKey& key) const;
  [[nodiscard]] Victim AsVictim(Items::iterator item) const;
  std::vector<Victim> FindVictims();
  Items::iterator FirstLinks();
  Items::iterator LastLinks();
  // Returns false if nothing is left to evict.
  bool EvictUntil(const std::function<bool()>& is_enough);
  // The same for items that are needed at `first_use` or later.
  bool EvictNeededFrom(uint64_t first_use,
                       const std::function<bool()>& is_enough);
  bool TryMakeRoom(uint64_t bytes, uint64_t needed_at);
  [[nodiscard]] uint64_t EvictionMargin() const;

  const NextUse* order_;
  MemoryBudget* budget_;
  Save save_;
  MemoryCharge trace_charge_;
  AccessTrace trace_;
  Items items_;
  uint64_t held_bytes_ = 0;  // by all items
  uint64_t clock_ = 0;
  // Bytes of excess for which nothing could be evicted this turn; not tried
  // again before the next.
  uint64_t accepted_excess_ = 0;
  // Whether InsertIfPossible has found no room this turn.
  bool is_full_ = false;
};

}  // namespace enfilade
