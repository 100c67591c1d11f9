// A cache of decoded things (element trees, link blocks, BVHs) by bytes, with
// the order of the future work told to it, so that it can do what is optimal:
// it evicts what is needed again last (Belady, "A study of replacement
// algorithms", IBM Systems Journal 5, 1966). What is in the cache at any time
// is a function of the calls made, never of addresses or the time.
//
// Every entry is charged to a MemoryBudget that others may share; they get
// memory back with EvictToFit. Not thread-safe: one scheduling thread owns a
// cache, and may hand the pointers it got to others.

#pragma once

#include "base/check.h"
#include "base/memory.h"

#include <algorithm>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace enfilade {

struct ByteCacheStats {
  uint64_t hits = 0;
  uint64_t misses = 0;
  uint64_t evictions = 0;
  uint64_t write_backs = 0;
  uint64_t bytes = 0;         // charged now
  uint64_t bytes_loaded = 0;  // by loaders, in all
};

// Key is ordered by <; Value may be const. An entry is pinned, and never
// evicted, while anybody else holds a shared_ptr to its value.
template <class Key, class Value>
class ByteCache {
 public:
  using Pointer = std::shared_ptr<Value>;

  struct Loaded {
    Pointer value;
    uint64_t bytes = 0;  // what the value occupies in memory
  };

  // When a key will be used next, in any unit that grows; kNever if it won't.
  using NextUse = std::function<uint64_t(const Key&)>;
  // Saves a dirty value. If it throws, the entry stays, and stays dirty.
  using WriteBack = std::function<void(const Key&, const Value&)>;
  using Loader = std::function<Loaded()>;

  static constexpr uint64_t kNever = UINT64_MAX;

  // `name` is for messages, e.g. "the element trees". The budget must outlive
  // the cache. Without a write_back nothing may be marked dirty.
  ByteCache(MemoryBudget& budget,
            std::string name,
            NextUse next_use,
            WriteBack write_back = {})
      : budget_(&budget),
        name_(std::move(name)),
        next_use_(std::move(next_use)),
        write_back_(std::move(write_back)) {}

  // Dirty entries are lost; call Flush() before.
  ~ByteCache() { budget_->Release(stats_.bytes); }

  ByteCache(const ByteCache&) = delete;
  ByteCache& operator=(const ByteCache&) = delete;

  // The cached value, or the one that the loader returns. Room for
  // `expected_bytes` is made and charged before the loader runs, and corrected
  // after it to what the value has. Throws DoesNotFitError when all that is
  // left is pinned, and what the loader throws; the cache then lacks the key.
  Pointer Get(const Key& key, uint64_t expected_bytes, const Loader& loader) {
    if (const auto found = entries_.find(key); found != entries_.end()) {
      ++stats_.hits;
      return found->second.value;
    }
    ++stats_.misses;
    Reserve(expected_bytes);
    Loaded loaded;
    try {
      loaded = loader();
      Reserve(loaded.bytes, expected_bytes);
    } catch (...) {
      Unreserve(expected_bytes);
      throw;
    }
    stats_.bytes_loaded += loaded.bytes;
    return Insert(key, std::move(loaded), false);
  }

  Pointer Get(const Key& key, const Loader& loader) {
    return Get(key, 0, loader);
  }

  // The cached value or null; counts neither as hit nor as miss.
  [[nodiscard]] Pointer Peek(const Key& key) const {
    const auto found = entries_.find(key);
    return found == entries_.end() ? nullptr : found->second.value;
  }

  // Adds or replaces a value; one that was there is dropped unsaved.
  void Put(const Key& key, Loaded loaded, bool dirty) {
    Erase(key);
    Reserve(loaded.bytes);
    Insert(key, std::move(loaded), dirty);
  }

  // The cached value has changed and must be written back.
  void MarkDirty(const Key& key) {
    ENFILADE_CHECK(write_back_ != nullptr, "{} cannot be saved", name_);
    At(key).dirty = true;
  }

  // The cached value has grown or shrunk. It is not evicted for its own sake.
  void Resize(const Key& key, uint64_t bytes) {
    Entry& entry = At(key);
    const Pointer pin = entry.value;
    Reserve(bytes, entry.bytes);
    entry.bytes = bytes;
  }

  // Writes back everything dirty, in the order of the keys; it stays cached.
  void Flush() {
    for (auto& [key, entry] : entries_) {
      Save(key, entry);
    }
  }

  // Drops an entry unsaved, if there is one.
  void Erase(const Key& key) {
    if (const auto found = entries_.find(key); found != entries_.end()) {
      Drop(found);
    }
  }

  // Drops every entry unsaved.
  void Clear() {
    while (!entries_.empty()) {
      Drop(entries_.begin());
    }
  }

  // Evicts until the budget has `bytes` free: first what is used last, ties in
  // the order of the keys. False when that is impossible; then everything that
  // is not pinned is gone.
  bool EvictToFit(uint64_t bytes) {
    if (budget_->FreeBytes() >= bytes) {
      return true;
    }
    std::vector<std::pair<uint64_t, Key>> victims;
    for (const auto& [key, entry] : entries_) {
      if (entry.value.use_count() <= 1) {
        victims.emplace_back(next_use_(key), key);
      }
    }
    std::stable_sort(
        victims.begin(), victims.end(), [](const auto& x, const auto& y) {
          return x.first > y.first;  // keys are ascending already
        });
    for (const auto& [next_use, key] : victims) {
      Evict(key);
      if (budget_->FreeBytes() >= bytes) {
        return true;
      }
    }
    return false;
  }

  [[nodiscard]] ByteCacheStats Stats() const { return stats_; }

  [[nodiscard]] size_t Size() const { return entries_.size(); }

 private:
  struct Entry {
    Pointer value;
    uint64_t bytes = 0;
    bool dirty = false;
  };

  using Entries = std::map<Key, Entry>;

  Entry& At(const Key& key) {
    const auto found = entries_.find(key);
    ENFILADE_CHECK(found != entries_.end(), "{}: no such entry", name_);
    return found->second;
  }

  // Charges, evicting as needed; others may charge at the same time.
  void Reserve(uint64_t bytes) {
    while (!budget_->TryCharge(bytes)) {
      if (!EvictToFit(bytes)) {
        budget_->Charge(bytes, name_);
        break;
      }
    }
    stats_.bytes += bytes;
  }

  void Unreserve(uint64_t bytes) {
    budget_->Release(bytes);
    stats_.bytes -= bytes;
  }

  // Turns a reservation of `old_bytes` into one of `bytes`.
  void Reserve(uint64_t bytes, uint64_t old_bytes) {
    if (bytes > old_bytes) {
      Reserve(bytes - old_bytes);
    } else {
      Unreserve(old_bytes - bytes);
    }
  }

  // Takes over the reservation of loaded.bytes.
  Pointer Insert(const Key& key, Loaded loaded, bool dirty) {
    ENFILADE_CHECK(loaded.value != nullptr, "{}: a null value", name_);
    ENFILADE_CHECK(
        !dirty || write_back_ != nullptr, "{} cannot be saved", name_);
    entries_[key] = Entry{loaded.value, loaded.bytes, dirty};
    return std::move(loaded.value);
  }

  void Save(const Key& key, Entry& entry) {
    if (entry.dirty) {
      write_back_(key, *entry.value);
      entry.dirty = false;
      ++stats_.write_backs;
    }
  }

  void Evict(const Key& key) {
    const auto found = entries_.find(key);
    if (found == entries_.end()) {
      return;  // erased by a write-back
    }
    Save(key, found->second);
    ++stats_.evictions;
    Drop(found);
  }

  void Drop(typename Entries::iterator entry) {
    const uint64_t bytes = entry->second.bytes;
    entries_.erase(entry);  // frees the memory before it is given back
    Unreserve(bytes);
  }

  MemoryBudget* budget_;
  std::string name_;
  NextUse next_use_;
  WriteBack write_back_;
  Entries entries_;
  ByteCacheStats stats_;
};

}  // namespace enfilade
