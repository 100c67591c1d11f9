// The part of the pager that makes room, and that keeps links where there is
// room for them.

#include "solver/cell_pager.h"

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
    Write(item->first, &item->second);
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
    case ItemKind::kTree:
      return next_use_.OfCell(cell);
    case ItemKind::kReceived:
      return next_use_.OfTurn(cell);
    case ItemKind::kObstacles:
    case ItemKind::kOccluder:
      return next_use_.OfBlockers(cell);
    case ItemKind::kLinks:
      return next_use_.OfLinks(cell, SourceOf(key));
  }
  return 0;
}

void CellPager::Consider(Items::iterator item, Victim* victim) {
  if (item == items_.end() || !item->second.use.expired()) {
    return;
  }
  const std::pair rank{NextUseOf(item->first), clock_ - item->second.last_use};
  if (victim->item == items_.end() || rank > victim->rank) {
    *victim = {item, rank};
  }
}

// Of the links, those that are needed last: right before the work's place in
// the order of receivers and sources, which goes round.
CellPager::Items::iterator CellPager::LastLinks() {
  const auto first = items_.lower_bound({ItemKind::kLinks, 0, 0, 0});
  if (first == items_.end()) {
    return first;
  }
  const auto [receiver, source] = next_use_.At();
  const auto here = items_.lower_bound({ItemKind::kLinks, receiver, source, 0});
  return here == first ? std::prev(items_.end()) : std::prev(here);
}

CellPager::Victim CellPager::FindVictim() {
  Victim victim{items_.end(), {}};
  const auto links = items_.lower_bound({ItemKind::kLinks, 0, 0, 0});
  for (auto it = items_.begin(); it != links; ++it) {
    Consider(it, &victim);
  }
  Consider(LastLinks(), &victim);
  return victim;
}

bool CellPager::EvictOne() {
  const Victim victim = FindVictim();
  if (victim.item == items_.end()) {
    return false;
  }
  Drop(victim.item);
  return true;
}

void CellPager::EvictAll() {
  while (EvictOne()) {
  }
  trace_.Restart();
  ReleaseFreedMemory();
}

// -------------------------------------------------------------- room

void CellPager::MakeRoom(uint64_t bytes, std::string_view what) {
  while (!budget_->TryCharge(bytes)) {
    if (!EvictOne()) {
      budget_->Charge(bytes, what);  // throws, naming the least cap
      return;
    }
  }
  HoldResident(bytes);
}

void CellPager::HoldResident(uint64_t coming_bytes) {
  uint64_t excess = budget_->ResidentExcess(coming_bytes);
  if (excess <= accepted_excess_) {
    return;
  }
  do {
    ReleaseFreedMemory();
    excess = budget_->ResidentExcess(coming_bytes);
  } while (excess > 0 && EvictOne());
  constexpr uint64_t kStep = 1 << 20;
  accepted_excess_ = excess > 0 ? excess + kStep : 0;
}

MemoryCharge CellPager::Reserve(uint64_t bytes, std::string_view what) {
  MakeRoom(bytes, what);
  budget_->Release(bytes);
  return {*budget_, bytes, what};
}

// Room for what may stay out as well: only that of what is needed later.
bool CellPager::TryMakeRoom(uint64_t bytes, uint64_t needed_at) {
  const auto fits = [&] {
    return budget_->ResidentExcess(bytes) <= accepted_excess_ &&
           budget_->TryCharge(bytes);
  };
  while (!fits()) {
    const Victim victim = FindVictim();
    if (victim.item == items_.end() || victim.rank.first <= needed_at) {
      return false;
    }
    Drop(victim.item);
  }
  return true;
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
    HoldResident(0);
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

void CellPager::KeepLinks(CellPair pair, WrittenLinks&& written) {
  const ItemKey key = LinksKey(pair, written.chunk);
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
