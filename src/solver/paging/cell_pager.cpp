#include "solver/paging/cell_pager.h"

#include "base/check.h"
#include "base/parallel.h"
#include "solver/elements/cell_delta.h"

#include <algorithm>
#include <utility>

namespace enfilade {

CellPager::CellPager(BlockStorage& store,
                     const SceneInfo& scene,
                     const Partition& partition,
                     TreeShape shape,
                     const OcclusionDevice& device,
                     MemoryBudget& budget)
    : store_(&store),
      partition_(&partition),
      stored_elements_(partition.cells.size()),
      surfaces_(MakeSurfaceTable(scene)),
      shape_(shape),
      device_(&device),
      budget_(&budget),
      maker_(scene, partition, device.Origin()),
      trace_charge_(budget,
                    AccessTrace::OwnBytesUnder(budget.LimitBytes()),
                    "the record of what is read"),
      trace_(trace_charge_.Bytes()),
      next_use_(store, partition.cells.size(), budget) {}

CellPager::~CellPager() {
  for (auto& [key, item] : items_) {
    budget_->Release(item.charged_bytes);
  }
}

CellId CellPager::SourceOf(ItemKey key) {
  return CellId(key.source == NextUse::kItself ? key.cell : key.source);
}

CachedThing CellPager::ThingOf(ItemKey key) {
  switch (key.kind) {
    case ItemKind::kTree:
    case ItemKind::kElements:
      return {{BlockKind::kCellTree, key.cell},
              static_cast<uint32_t>(key.kind)};
    case ItemKind::kWeights:
      return {{BlockKind::kSourceWeights, key.cell}};
    case ItemKind::kDelta:
      return {{BlockKind::kCellDelta, key.cell}};
    case ItemKind::kReceived:
      return {{BlockKind::kReceived, key.cell}};
    case ItemKind::kLinks:
      return {{BlockKind::kLinks, key.cell, SourceOf(key).value, key.chunk}};
    default:
      return {{BlockKind::kCellPatches, key.cell},
              static_cast<uint32_t>(key.kind)};
  }
}

CellPager::Item* CellPager::Find(ItemKey key) {
  const auto it = items_.find(key);
  return it == items_.end() ? nullptr : &it->second;
}

// `bytes` are charged to the budget already, by the caller or by the value
// itself.
void CellPager::Insert(ItemKey key,
                       std::shared_ptr<void> value,
                       uint64_t bytes) {
  Item& item = items_[key];
  item.value = std::move(value);
  item.charged_bytes = key.kind == ItemKind::kOccluder ? 0 : bytes;
  SetHeld(key, &item, bytes);
}

void CellPager::SetHeld(ItemKey key, Item* item, uint64_t bytes) {
  held_bytes_ += bytes - item->held_bytes;
  item->held_bytes = bytes;
  trace_.SetHeld(ThingOf(key), bytes);
}

// The value of an item in memory; it is in use as long as the pointer is held.
std::shared_ptr<void> CellPager::UseItem(ItemKey key,
                                         Item* item,
                                         bool is_along) {
  item->last_use = ++clock_;
  auto use = item->use.lock();
  if (use == nullptr) {
    NoteCapacity();
    const CachedThing thing = ThingOf(key);
    is_along ? trace_.BeginAlong(thing) : trace_.Begin(thing);
    use = std::shared_ptr<void>(
        item->value.get(),
        [this, thing, value = item->value](void*) { trace_.End(thing); });
    item->use = use;
  }
  return use;
}

// The capacity is the part of the budget that others than the pager do not use.
void CellPager::NoteCapacity() {
  const uint64_t used = budget_->UsedBytes();
  const uint64_t by_others = used - std::min(used, held_bytes_);
  const uint64_t limit = budget_->LimitBytes();
  trace_.SetCapacity(limit - std::min(limit, by_others));
}

void CellPager::ForgetWeights(CellId cell) {
  Forget({ItemKind::kWeights, cell.value});
  EraseSourceWeights(*store_, cell);
}

void CellPager::ForgetDelta(CellId cell) {
  Forget({ItemKind::kDelta, cell.value});
  EraseDelta(*store_, cell);
}

void CellPager::Forget(ItemKey key) {
  const auto item = items_.find(key);
  if (item != items_.end()) {
    ENFILADE_CHECK(item->second.use.expired(), "what is forgotten is in use");
    item->second.dirty = false;
    Drop(item);
  }
}

// Charges the budget for an item in use that now takes `bytes`.
void CellPager::Recharge(ItemKey key, uint64_t bytes, std::string_view what) {
  Item& item = items_.at(key);
  if (bytes > item.charged_bytes) {
    MakeRoom(bytes - item.charged_bytes, what);
  } else {
    budget_->Release(item.charged_bytes - bytes);
  }
  item.charged_bytes = bytes;
  SetHeld(key, &item, bytes);
}

uint64_t CellPager::Save(ItemKey key, const Item& item) const {
  const CellId cell(key.cell);
  const void* value = item.value.get();
  switch (key.kind) {
    case ItemKind::kTree:
      return static_cast<const CellTree*>(value)->Save(*store_, cell);
    case ItemKind::kDelta:
      return SaveDelta(
          *store_, cell, *static_cast<const CoefficientArray*>(value));
    case ItemKind::kWeights:
      return SaveSourceWeights(
          *store_, cell, *static_cast<const SourceWeights*>(value));
    case ItemKind::kReceived:
      return static_cast<const ReceivedLight*>(value)->Save(*store_, cell);
    default:
      ENFILADE_CHECK(false, "a thing that never changes is dirty");
      return 0;
  }
}

void CellPager::NoteSaved(ItemKey key, Item* item, uint64_t stored_bytes) {
  if (key.kind == ItemKind::kTree) {
    stored_elements_[key.cell] = static_cast<uint32_t>(
        std::static_pointer_cast<CellTree>(item->value)->Size());
  }
  trace_.SetStored(ThingOf(key), stored_bytes);
  item->dirty = false;
}

void CellPager::Flush() {
  std::vector<Items::iterator> dirty;
  for (auto it = items_.begin(); it != items_.end(); ++it) {
    if (it->second.dirty) {
      dirty.push_back(it);
    }
  }
  std::vector<uint64_t> stored(dirty.size());
  ParallelFor(dirty.size(), [&](size_t i) {
    stored[i] = Save(dirty[i]->first, dirty[i]->second);
  });
  for (size_t i = 0; i < dirty.size(); ++i) {
    NoteSaved(dirty[i]->first, &dirty[i]->second, stored[i]);
  }
}

}  // namespace enfilade
