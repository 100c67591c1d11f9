// The part of the pager that makes room, and that keeps links in memory if
// there is room for them.

#include "solver/paging/cell_pager.h"

#include <algorithm>
#include <iterator>
#include <memory>
#include <utility>

namespace enfilade {
namespace {

// What an item takes beside its value.
constexpr uint64_t kItemBytes = 256;

uint64_t LinkItemBytes(const LinkBlock& block) {
  return block.SizeBytes() + kItemBytes;
}

}  // namespace

// ------------------------------------------------------------- what goes

void CellPager::Drop(Items::iterator item) {
  if (item->second.dirty) {
    NoteSaved(item->first, &item->second, Save(item->first, item->second));
  }
  item->second.value.reset();
  held_bytes_ -= item->second.held_bytes;
  budget_->Release(item->second.charged_bytes);
  items_.erase(item);
}

uint64_t CellPager::NextUseOf(ItemKey key) const {
  const CellId cell(key.cell);
  switch (key.kind) {
    case ItemKind::kGeometry:
      return next_use_.OfCell(cell);
    case ItemKind::kTree:
      return next_use_.OfTree(cell);
    case ItemKind::kElements:
    case ItemKind::kDelta:
      return next_use_.OfNews(cell);
    case ItemKind::kReceived:
      return next_use_.OfTurn(cell);
    case ItemKind::kWeights:
      return next_use_.OfWeights(cell);
    case ItemKind::kObstacles:
    case ItemKind::kOccluder:
      return next_use_.OfBlockers(cell);
    case ItemKind::kLinks:
      return next_use_.OfLinks(cell, SourceOf(key));
  }
  return 0;
}

// Returns no victim if the item is in use.
CellPager::Victim CellPager::AsVictim(Items::iterator item) const {
  if (item == items_.end() || !item->second.use.expired()) {
    return {};
  }
  return {item, true, {NextUseOf(item->first), clock_ - item->second.last_use}};
}

// The links that are needed last: those right before the work's place in the
// order of receivers and sources, which is cyclic.
CellPager::Items::iterator CellPager::LastLinks() {
  const auto first = items_.lower_bound({ItemKind::kLinks, 0, 0, 0});
  if (first == items_.end()) {
    return first;
  }
  const auto [receiver, source] = next_use_.At();
  const auto here = items_.lower_bound({ItemKind::kLinks, receiver, source, 0});
  return here == first ? std::prev(items_.end()) : std::prev(here);
}

// Returns all victims except links, as a heap.
std::vector<CellPager::Victim> CellPager::FindVictims() {
  std::vector<Victim> victims;
  const auto links = items_.lower_bound({ItemKind::kLinks, 0, 0, 0});
  for (auto it = items_.begin(); it != links; ++it) {
    if (const Victim victim = AsVictim(it); victim.exists) {
      victims.push_back(victim);
    }
  }
  std::make_heap(victims.begin(), victims.end(), GoesLater);
  return victims;
}

// Whether `bytes` could be charged if all were evicted that is not in use.
bool CellPager::CanFree(uint64_t bytes) const {
  uint64_t room = budget_->FreeBytes();
  for (auto it = items_.begin(); room < bytes && it != items_.end(); ++it) {
    room += it->second.use.expired() ? it->second.charged_bytes : 0;
  }
  return room >= bytes;
}

bool CellPager::EvictUntil(const std::function<bool()>& is_enough) {
  return EvictNeededFrom(0, is_enough);
}

bool CellPager::EvictNeededFrom(uint64_t first_use,
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
uint64_t CellPager::EvictionMargin() const {
  constexpr uint64_t kMost = 4 << 20;
  constexpr uint64_t kParts = 256;
  return std::min(kMost, budget_->LimitBytes() / kParts);
}

void CellPager::EvictAll() {
  EvictUntil([] { return false; });
  trace_.Restart();
  ReleaseFreedMemory();
}

// -------------------------------------------------------------- room

void CellPager::MakeRoom(uint64_t bytes, std::string_view what) {
  if (!budget_->TryCharge(bytes)) {
    const uint64_t wanted = bytes + EvictionMargin();
    EvictUntil([&] { return budget_->FreeBytes() >= wanted; });
    budget_->Charge(bytes, what);  // may throw, naming the least cap
  }
  HoldResident(bytes);
}

// Memory freed by eviction may serve what is coming. Only what is left of the
// freed memory beyond that is given back to the system.
void CellPager::HoldResident(uint64_t coming_bytes) {
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

MemoryCharge CellPager::Reserve(uint64_t bytes, std::string_view what) {
  MakeRoom(bytes, what);
  budget_->Release(bytes);
  return {*budget_, bytes, what};
}

MemoryCharge CellPager::ReserveIfPossible(uint64_t bytes,
                                          std::string_view what) {
  const bool fits =
      CanFree(bytes) &&
      EvictUntil([&] { return budget_->FreeBytes() >= bytes; });
  HoldResident(bytes);
  return fits ? MemoryCharge(*budget_, bytes, what) : MemoryCharge();
}

// Makes room for an item that need not be kept in memory: evicts only items
// that are needed later than `needed_at`. Where none was found, none is sought
// again in the same turn: a search looks at all items, and nearly all links are
// needed later than what is in memory already.
bool CellPager::TryMakeRoom(uint64_t bytes, uint64_t needed_at) {
  const auto is_resident_far = [&] {
    return budget_->ResidentExcess(bytes) <= accepted_excess_;
  };
  if (is_resident_far() && budget_->TryCharge(bytes)) {
    return true;
  }
  // Evicted memory stays resident until it is given back to the system.
  const auto has_room = [&](uint64_t wanted) {
    return budget_->FreeBytes() >= wanted &&
           budget_->InUseExcess(wanted) <= accepted_excess_;
  };
  if (is_full_) {
    return false;
  }
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

// -------------------------------------------------------------- links

CellPager::ItemKey CellPager::LinksKey(CellPair pair, uint32_t chunk) {
  const bool is_itself = pair.receiver == pair.source;
  return {ItemKind::kLinks,
          pair.receiver.value,
          is_itself ? NextUse::kItself : pair.source.value,
          chunk};
}

void CellPager::VisitLinks(CellPair pair,
                           const LinkEnds& ends,
                           const std::function<void(const LinkBlock&)>& visit) {
  for (uint32_t chunk = 0;; ++chunk) {
    const ItemKey key = LinksKey(pair, chunk);
    const CachedThing thing = ThingOf(key);
    if (Item* item = Find(key)) {
      NoteCapacity();
      trace_.Touch(thing);
      item->last_use = ++clock_;
      visit(*std::static_pointer_cast<LinkBlock>(item->value));
      continue;
    }
    HoldResident();
    const uint64_t read_before = store_->Stats().bytes_read;
    auto block = ReadLinks(*store_, pair, chunk, ends);
    if (!block) {
      return;
    }
    const uint64_t read = store_->Stats().bytes_read - read_before;
    trace_.AddRead(read);
    trace_.SetStored(thing, read);
    trace_.SetHeld(thing, LinkItemBytes(*block));
    NoteCapacity();
    trace_.Touch(thing);
    visit(*block);
    KeepBlock(key, std::move(*block));
  }
}

void CellPager::KeepLinks(LinkChunk&& written) {
  const ItemKey key = LinksKey(written.pair, written.chunk);
  const CachedThing thing = ThingOf(key);
  trace_.SetStored(thing, written.stored_bytes);
  trace_.SetHeld(thing, LinkItemBytes(written.block));
  NoteCapacity();
  trace_.Make(thing);
  KeepBlock(key, std::move(written.block));
}

void CellPager::ForgetLinks() {
  auto it = items_.lower_bound({ItemKind::kLinks, 0, 0, 0});
  while (it != items_.end()) {
    Drop(it++);
  }
}

void CellPager::KeepBlock(ItemKey key, LinkBlock&& block) {
  const uint64_t bytes = LinkItemBytes(block);
  if (TryMakeRoom(bytes, NextUseOf(key))) {
    Insert(key, std::make_shared<LinkBlock>(std::move(block)), bytes);
    items_.at(key).last_use = ++clock_;
  }
}

}  // namespace enfilade
