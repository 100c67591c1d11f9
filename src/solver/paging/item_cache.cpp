#include "solver/paging/item_cache.h"

#include "base/check.h"
#include "base/parallel.h"

#include <algorithm>
#include <iterator>

namespace enfilade {

ItemCache::ItemCache(const NextUse& order, MemoryBudget& budget, Save save)
    : order_(&order),
      budget_(&budget),
      save_(std::move(save)),
      trace_charge_(budget,
                    AccessTrace::OwnBytesUnder(budget.LimitBytes()),
                    "the record of what is read"),
      trace_(trace_charge_.Bytes()) {}

ItemCache::~ItemCache() {
  for (auto& [key, item] : items_) {
    budget_->Release(item.bytes.charged);
  }
}

// ---------------------------------------------------------------- items

uint64_t ItemCache::HeldBytes(const ItemKey& key) const {
  const auto it = items_.find(key);
  return it == items_.end() ? 0 : it->second.bytes.held;
}

std::shared_ptr<void> ItemCache::UseItem(const ItemKey& key, bool is_along) {
  const auto it = items_.find(key);
  if (it == items_.end()) {
    return nullptr;
  }
  Item& item = it->second;
  item.last_use = ++clock_;
  auto use = item.use.lock();
  if (use == nullptr) {
    NoteCapacity();
    const CachedThing thing = ThingOf(key);
    const CachedBytes bytes = {item.bytes.held, item.bytes.stored};
    is_along ? trace_.BeginAlong(thing, bytes) : trace_.Begin(thing, bytes);
    use = std::shared_ptr<void>(
        item.value.get(),
        [this, thing, value = item.value](void*) { trace_.End(thing); });
    item.use = use;
  }
  return use;
}

const void* ItemCache::UseItemBriefly(const ItemKey& key) {
  const auto it = items_.find(key);
  if (it == items_.end()) {
    return nullptr;
  }
  Item& item = it->second;
  item.last_use = ++clock_;
  NoteUse(key, item.bytes);
  return item.value.get();
}

void ItemCache::Insert(const ItemKey& key,
                       std::shared_ptr<void> value,
                       Bytes bytes) {
  const auto [it, is_new] = items_.try_emplace(key);
  ENFILADE_CHECK(is_new, "an item of cell {} is in memory already", key.cell);
  Item& item = it->second;
  item.value = std::move(value);
  item.bytes = bytes;
  item.last_use = ++clock_;
  held_bytes_ += bytes.held;
}

void ItemCache::InsertChanged(const ItemKey& key,
                              std::shared_ptr<void> value,
                              Bytes bytes) {
  Insert(key, std::move(value), bytes);
  items_.at(key).is_changed = true;
  NoteMade(key, bytes);
}

void ItemCache::InsertIfPossible(const ItemKey& key,
                                 std::shared_ptr<void> value,
                                 Bytes bytes) {
  if (TryMakeRoom(bytes.charged, NextUseOf(key))) {
    Insert(key, std::move(value), bytes);
  }
}

void ItemCache::SetHeld(const ItemKey& key, Item* item, uint64_t bytes) {
  held_bytes_ += bytes - item->bytes.held;
  item->bytes.held = bytes;
  trace_.Resize(ThingOf(key), bytes);
}

ItemCache::Items::iterator ItemCache::Changing(const ItemKey& key,
                                               std::string_view what) {
  const auto it = items_.find(key);
  ENFILADE_CHECK(it != items_.end() && !it->second.use.expired(),
                 "what is changed is not in use: {}",
                 what);
  return it;
}

void ItemCache::MarkChanged(const ItemKey& key,
                            uint64_t bytes,
                            std::string_view what) {
  const auto item = Changing(key, what);
  item->second.is_changed = true;
  Recharge(item, bytes, what);
}

void ItemCache::Resize(const ItemKey& key,
                       uint64_t bytes,
                       std::string_view what) {
  Recharge(Changing(key, what), bytes, what);
}

void ItemCache::Recharge(Items::iterator item,
                         uint64_t bytes,
                         std::string_view what) {
  Bytes& now = item->second.bytes;
  if (bytes > now.charged) {
    MakeRoom(bytes - now.charged, what);  // evicts nothing that is in use
  } else {
    budget_->Release(now.charged - bytes);
  }
  now.charged = bytes;
  SetHeld(item->first, &item->second, bytes);
}

void ItemCache::Forget(const ItemKey& key) {
  const auto item = items_.find(key);
  if (item != items_.end()) {
    ENFILADE_CHECK(item->second.use.expired(), "what is forgotten is in use");
    item->second.is_changed = false;
    Drop(item);
  }
}

void ItemCache::ForgetAllLinks() {
  for (auto it = FirstLinks(); it != items_.end();) {
    Drop(it++);
  }
}

void ItemCache::WriteBack(Items::iterator item, uint64_t stored_bytes) {
  item->second.bytes.stored = stored_bytes;
  item->second.is_changed = false;
}

void ItemCache::Flush() {
  std::vector<Items::iterator> changed;
  for (auto it = items_.begin(); it != items_.end(); ++it) {
    if (it->second.is_changed) {
      changed.push_back(it);
    }
  }
  std::vector<uint64_t> stored(changed.size());
  ParallelFor(changed.size(), [&](size_t i) {
    stored[i] = save_(changed[i]->first, changed[i]->second.value.get());
  });
  for (size_t i = 0; i < changed.size(); ++i) {
    WriteBack(changed[i], stored[i]);
  }
}

void ItemCache::Drop(Items::iterator item) {
  if (item->second.is_changed) {
    WriteBack(item, save_(item->first, item->second.value.get()));
  }
  item->second.value.reset();
  held_bytes_ -= item->second.bytes.held;
  budget_->Release(item->second.bytes.charged);
  items_.erase(item);
}

// ---------------------------------------------------------------- what goes

uint64_t ItemCache::NextUseOf(const ItemKey& key) const {
  const CellId cell = key.Cell();
  switch (key.kind) {
    case ItemKind::kGeometry:
      return order_->OfCell(cell);
    case ItemKind::kTree:
      return order_->OfTree(cell);
    case ItemKind::kElements:
    case ItemKind::kDelta:
      return order_->OfNews(cell);
    case ItemKind::kReceived:
      return order_->OfTurn(cell);
    case ItemKind::kWeights:
      return order_->OfWeights(cell);
    case ItemKind::kShaftBlockers:
    case ItemKind::kRayBlockers:
      return order_->OfBlockers(cell);
    case ItemKind::kLinks:
      return order_->OfLinks(cell, key.Source());
  }
  return 0;
}

// Returns no victim if the item is in use.
ItemCache::Victim ItemCache::AsVictim(Items::iterator item) const {
  if (item == items_.end() || !item->second.use.expired()) {
    return {};
  }
  return {item, true, {NextUseOf(item->first), clock_ - item->second.last_use}};
}

ItemCache::Items::iterator ItemCache::FirstLinks() {
  return items_.lower_bound({ItemKind::kLinks, 0, 0, 0});
}

// The links that are needed last: those right before the work's place in the
// order of receivers and sources, which is cyclic.
ItemCache::Items::iterator ItemCache::LastLinks() {
  const auto first = FirstLinks();
  if (first == items_.end()) {
    return first;
  }
  const auto [receiver, source] = order_->At();
  const auto here = items_.lower_bound({ItemKind::kLinks, receiver, source, 0});
  return here == first ? std::prev(items_.end()) : std::prev(here);
}

// Returns all victims except links, as a heap.
std::vector<ItemCache::Victim> ItemCache::FindVictims() {
  std::vector<Victim> victims;
  const auto links = FirstLinks();
  for (auto it = items_.begin(); it != links; ++it) {
    if (const Victim victim = AsVictim(it); victim.exists) {
      victims.push_back(victim);
    }
  }
  std::make_heap(victims.begin(), victims.end(), GoesLater);
  return victims;
}

bool ItemCache::EvictUntil(const std::function<bool()>& is_enough) {
  return EvictNeededFrom(0, is_enough);
}

bool ItemCache::EvictNeededFrom(uint64_t first_use,
                                const std::function<bool()>& is_enough) {
  if (is_enough()) {
    return true;
  }
  std::vector<Victim> victims = FindVictims();
  do {
    const Victim links = AsVictim(LastLinks());
    const bool is_links = victims.empty() || GoesLater(victims.front(), links);
    const Victim& last = is_links ? links : victims.front();
    if (!last.exists || last.rank.first < first_use) {
      return false;
    }
    Drop(last.item);
    if (!is_links) {
      std::pop_heap(victims.begin(), victims.end(), GoesLater);
      victims.pop_back();
    }
  } while (!is_enough());
  return true;
}

// The bytes evicted beyond those needed now: finding victims, and giving memory
// back to the system, takes as long for one item as for many.
uint64_t ItemCache::EvictionMargin() const {
  constexpr uint64_t kMost = 4 << 20;
  constexpr uint64_t kParts = 256;
  return std::min(kMost, budget_->LimitBytes() / kParts);
}

void ItemCache::EvictAll() {
  EvictUntil([] { return false; });
  trace_.Restart();
  ReleaseFreedMemory();
}

// ---------------------------------------------------------------- room

void ItemCache::MakeRoom(uint64_t bytes, std::string_view what) {
  if (!budget_->TryCharge(bytes)) {
    const uint64_t wanted = bytes + EvictionMargin();
    EvictUntil([&] { return budget_->FreeBytes() >= wanted; });
    budget_->Charge(bytes, what);  // may throw, naming the least cap
  }
  HoldResident(bytes);
}

// Memory freed by eviction may serve what is coming. Only what is left of the
// freed memory beyond that is given back to the system.
void ItemCache::HoldResident(uint64_t coming_bytes) {
  if (budget_->ResidentExcess(coming_bytes) <= accepted_excess_) {
    return;
  }
  // Leaves room for memory that is freed before the next call.
  const uint64_t headroom = EvictionMargin();
  const auto excess_in_use = [&] {
    return budget_->InUseExcess(coming_bytes + headroom);
  };
  bool is_gone = true;  // whether eviction reached `wanted`
  while (is_gone && held_bytes_ > 0) {
    const uint64_t excess = excess_in_use();
    if (excess == 0) {
      break;
    }
    const uint64_t wanted = held_bytes_ - std::min(held_bytes_, excess);
    is_gone = EvictUntil([&] { return held_bytes_ <= wanted; });
  }
  if (budget_->ResidentExcess(coming_bytes) > 0) {
    ReleaseFreedMemory();
  }
  constexpr uint64_t kStep = 1 << 20;
  const uint64_t excess = budget_->ResidentExcess(coming_bytes);
  accepted_excess_ = excess > 0 ? excess + kStep : 0;
}

void ItemCache::StartTurn() {
  accepted_excess_ = 0;
  is_full_ = false;
}

MemoryCharge ItemCache::Reserve(uint64_t bytes, std::string_view what) {
  MakeRoom(bytes, what);
  budget_->Release(bytes);
  return {*budget_, bytes, what};
}

bool ItemCache::CanFree(uint64_t bytes) const {
  uint64_t room = budget_->FreeBytes();
  for (auto it = items_.begin(); room < bytes && it != items_.end(); ++it) {
    room += it->second.use.expired() ? it->second.bytes.held : 0;
  }
  return room >= bytes;
}

MemoryCharge ItemCache::ReserveIfPossible(uint64_t bytes,
                                          std::string_view what) {
  const bool fits = CanFree(bytes) &&
                    EvictUntil([&] { return budget_->FreeBytes() >= bytes; });
  HoldResident(bytes);
  return fits ? MemoryCharge(*budget_, bytes, what) : MemoryCharge();
}

// Makes room for an item that need not be kept in memory: evicts only items
// that are needed later than `needed_at`.
bool ItemCache::TryMakeRoom(uint64_t bytes, uint64_t needed_at) {
  const auto is_resident_far = [&] {
    return budget_->ResidentExcess(bytes) <= accepted_excess_;
  };
  if (is_resident_far() && budget_->TryCharge(bytes)) {
    return true;
  }
  if (is_full_) {
    return false;
  }
  // Evicted memory stays resident until it is given back to the system.
  const auto has_room = [&](uint64_t wanted) {
    return budget_->FreeBytes() >= wanted &&
           budget_->InUseExcess(wanted) <= accepted_excess_;
  };
  const uint64_t wanted = bytes + EvictionMargin();
  EvictNeededFrom(needed_at + 1, [&] { return has_room(wanted); });
  if (!has_room(bytes)) {
    is_full_ = true;
    return false;
  }
  if (!is_resident_far()) {
    ReleaseFreedMemory();
  }
  return budget_->TryCharge(bytes);
}

// ---------------------------------------------------------------- reads

void ItemCache::NoteUse(const ItemKey& key, Bytes bytes) {
  NoteCapacity();
  trace_.Touch(ThingOf(key), {bytes.held, bytes.stored});
}

void ItemCache::NoteMade(const ItemKey& key, Bytes bytes) {
  NoteCapacity();
  trace_.Make(ThingOf(key), {bytes.held, bytes.stored});
}

// The capacity is the part of the budget that others than the cache do not use.
void ItemCache::NoteCapacity() {
  const uint64_t used = budget_->UsedBytes();
  const uint64_t by_others = used - std::min(used, held_bytes_);
  const uint64_t limit = budget_->LimitBytes();
  trace_.SetCapacity(limit - std::min(limit, by_others));
}

}  // namespace enfilade
