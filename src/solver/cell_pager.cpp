#include "solver/cell_pager.h"

#include "base/check.h"
#include "partition/patch.h"
#include "solver/cell_delta.h"

#include <algorithm>
#include <utility>

namespace enfilade {
namespace {

constexpr std::string_view kGeometryPurpose = "the geometry of a cell";
constexpr std::string_view kTreePurpose = "the element trees of a cell";
constexpr std::string_view kDeltaPurpose = "what a cell has sent last";
constexpr std::string_view kReceivedPurpose = "what a cell has received";
constexpr std::string_view kWeightsPurpose = "what a cell sends at most";

}  // namespace

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
    case ItemKind::kWeights:
      return {{BlockKind::kCellTree, key.cell},
              static_cast<uint32_t>(key.kind)};
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

// `bytes` are charged to the budget, or are so by the value itself.
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

// The value of an item that is there, in use as long as the pointer is held.
template <typename T>
std::shared_ptr<T> CellPager::Use(ItemKey key, Item* item, bool is_along) {
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
  return std::static_pointer_cast<T>(use);
}

// The same of one that `read` takes from the store if it is not there. Room
// first, of `bytes()`: it is in nobody's charge while it is read.
template <typename T, typename Bytes, typename Read>
std::shared_ptr<T> CellPager::UseStored(ItemKey key,
                                        std::string_view what,
                                        const Bytes& bytes,
                                        const Read& read) {
  if (Find(key) == nullptr) {
    const uint64_t read_before = store_->Stats().bytes_read;
    MemoryCharge room = Reserve(bytes(), what);
    auto value = std::make_shared<T>(read());
    const uint64_t read_bytes = store_->Stats().bytes_read - read_before;
    trace_.AddRead(read_bytes);
    trace_.SetStored(ThingOf(key), read_bytes);
    room.Reset();
    const uint64_t held = value->SizeBytes();
    MakeRoom(held, what);
    Insert(key, std::move(value), held);
  }
  return Use<T>(key);
}

// What is not taken by others.
void CellPager::NoteCapacity() {
  const uint64_t used = budget_->UsedBytes();
  const uint64_t by_others = used - std::min(used, held_bytes_);
  const uint64_t limit = budget_->LimitBytes();
  trace_.SetCapacity(limit - std::min(limit, by_others));
}

std::shared_ptr<const CellGeometry> CellPager::Geometry(CellId cell) {
  const ItemKey key{ItemKind::kGeometry, cell.value};
  if (Find(key) == nullptr) {
    // Room first: of what it is made of, and while it is made.
    MemoryCharge room =
        ReserveIfPossible(maker_.GeometryWorkBytes(cell), kGeometryPurpose);
    const CellPatches stored = ReadPatches(cell, {key.kind});
    auto geometry = std::make_shared<CellGeometry>(
        maker_.MakeGeometry(cell, stored, !shape_.basis->HasOwnNodes()));
    room.Reset();
    const uint64_t bytes = geometry->SizeBytes();
    MakeRoom(bytes, kGeometryPurpose);
    Insert(key, std::move(geometry), bytes);
  }
  return Use<const CellGeometry>(key);
}

// Reads the patches of a cell, from which items of some kinds will be made.
CellPatches CellPager::ReadPatches(CellId cell,
                                   std::initializer_list<ItemKind> made) {
  const uint64_t read_before = store_->Stats().bytes_read;
  CellPatches stored = LoadCellPatches(*store_, cell);
  const uint64_t bytes = store_->Stats().bytes_read - read_before;
  trace_.AddRead(bytes);
  for (const ItemKind kind : made) {
    trace_.SetStored(ThingOf({kind, cell.value}), bytes);
  }
  return stored;
}

std::shared_ptr<const ShaftBlockers> CellPager::Obstacles(CellId cell) {
  const ItemKey key{ItemKind::kObstacles, cell.value};
  if (Find(key) == nullptr) {
    MakeObstacles(cell, ReadPatches(cell, {key.kind}));
  }
  return Use<const ShaftBlockers>(key);
}

std::shared_ptr<const CellBlockers> CellPager::Occluder(CellId cell) {
  const ItemKey key{ItemKind::kOccluder, cell.value};
  if (Find(key) == nullptr) {
    MakeOccluder(cell, ReadPatches(cell, {key.kind}));
  }
  return Use<const CellBlockers>(key);
}

CellPager::CellObstructions CellPager::Obstructions(CellId cell) {
  const ItemKey shafts{ItemKind::kObstacles, cell.value};
  const ItemKey rays{ItemKind::kOccluder, cell.value};
  Item* const shafts_item = Find(shafts);
  Item* const rays_item = Find(rays);
  const bool has_shafts = shafts_item != nullptr;
  const bool has_rays = rays_item != nullptr;
  if (has_shafts && has_rays) {
    return {Use<const ShaftBlockers>(shafts, shafts_item, false),
            Use<const CellBlockers>(rays, rays_item, true)};
  }
  CellObstructions both;
  if (has_shafts) {
    both.obstacles = Use<const ShaftBlockers>(shafts);
  }
  const CellPatches stored = has_shafts ? ReadPatches(cell, {rays.kind})
                             : has_rays
                                 ? ReadPatches(cell, {shafts.kind})
                                 : ReadPatches(cell, {shafts.kind, rays.kind});
  if (!has_shafts) {
    MakeObstacles(cell, stored);
    both.obstacles = Use<const ShaftBlockers>(shafts);
  }
  if (Find(rays) == nullptr) {
    MakeOccluder(cell, stored);
  }
  both.occluder = Use<const CellBlockers>(rays, true);
  return both;
}

void CellPager::MakeObstacles(CellId cell, const CellPatches& stored) {
  // The patches too, while the obstacles are made of them.
  const size_t count = BlockerCount(stored);
  const uint64_t bytes = ShaftBlockers::BytesFor(count);
  MemoryCharge work =
      Reserve(bytes + count * sizeof(PatchGeometry), "the blockers of a cell");
  auto obstacles =
      std::make_shared<ShaftBlockers>(maker_.MakeObstacles(stored));
  work.Reset();
  MakeRoom(obstacles->SizeBytes(), "the blockers of a cell");
  Insert({ItemKind::kObstacles, cell.value}, obstacles, obstacles->SizeBytes());
}

void CellPager::MakeOccluder(CellId cell, const CellPatches& stored) {
  // Embree charges the budget itself; this only makes the room.
  const uint64_t estimate = BlockersBuildBytes(BlockerCount(stored));
  MakeRoom(estimate, "the blockers of a cell");
  budget_->Release(estimate);
  const std::shared_ptr<const CellBlockers> blockers = device_->Build(stored);
  Insert({ItemKind::kOccluder, cell.value},
         std::const_pointer_cast<CellBlockers>(blockers),
         BlockersBytes(*blockers));
}

bool CellPager::CanHoldBlockers(const std::vector<CellId>& cells) const {
  uint64_t need = 0;
  uint64_t build = 0;
  for (const CellId cell : cells) {
    const size_t patches = partition_->cells[cell.Index()].patches;
    const auto add = [&](ItemKind kind, uint64_t bytes, uint64_t more) {
      const auto it = items_.find({kind, cell.value});
      const bool is_here = it != items_.end();
      need += is_here ? it->second.held_bytes : bytes;
      build = std::max(build, is_here ? 0 : more);
    };
    const uint64_t held = BlockersHeldBytes(patches);
    add(ItemKind::kObstacles,
        ShaftBlockers::BytesFor(patches),
        patches * sizeof(PatchGeometry));
    add(ItemKind::kOccluder, held, BlockersBuildBytes(patches) - held);
  }
  // What is pinned cannot be evicted when the process itself comes near the
  // cap.
  need += build + budget_->ResidentBeyondCharges();
  uint64_t room = budget_->FreeBytes();
  for (auto it = items_.begin(); room < need && it != items_.end(); ++it) {
    room += it->second.use.expired() ? it->second.held_bytes : 0;
  }
  return need <= room;
}

size_t CellPager::StoredElements(CellId cell) {
  uint32_t& known = stored_elements_[cell.Index()];
  if (known == 0) {
    known = static_cast<uint32_t>(CellTree::StoredSize(*store_, cell));
  }
  return known;
}

std::shared_ptr<CellTree> CellPager::Tree(CellId cell) {
  const ItemKey key{ItemKind::kTree, cell.value};
  if (Find(key) != nullptr) {
    return Use<CellTree>(key);
  }
  if (const auto elements = items_.find({ItemKind::kElements, cell.value});
      elements != items_.end()) {
    Drop(elements);  // what it shows may change from now on
  }
  const auto geometry = Geometry(cell);
  const auto& patches = geometry->patches;
  return UseStored<CellTree>(
      key,
      kTreePurpose,
      [&] { return CellTree::BytesFor(StoredElements(cell), shape_); },
      [&] {
        if (auto stored = CellTree::Load(*store_, cell, shape_, patches)) {
          return std::move(*stored);
        }
        CellTree tree(shape_, patches);
        tree.Sent() = PushPull({tree, patches, surfaces_});
        return tree;
      });
}

std::shared_ptr<const CellTree> CellPager::Elements(CellId cell) {
  if (Find({ItemKind::kTree, cell.value}) != nullptr) {
    return Tree(cell);
  }
  const auto geometry = Geometry(cell);
  return UseStored<CellTree>(
      {ItemKind::kElements, cell.value},
      kTreePurpose,
      [&] { return CellTree::ElementBytesFor(StoredElements(cell)); },
      [&] {
        return CellTree::LoadElements(*store_, cell, shape_, geometry->patches)
            .value();
      });
}

std::shared_ptr<CoefficientArray> CellPager::Delta(CellId cell) {
  const auto tree = Elements(cell);
  const auto bytes_for = [this](size_t elements) {
    return CoefficientArray::BytesFor(elements, shape_.Stride());
  };
  auto delta = UseStored<CoefficientArray>(
      {ItemKind::kDelta, cell.value},
      kDeltaPurpose,
      [&] { return bytes_for(tree->Size()); },
      [&] { return LoadDelta(*store_, cell, shape_, tree->Size()); });
  if (delta->Size() > 0 && delta->Size() < tree->Size()) {
    Reserve(bytes_for(tree->Size() - delta->Size()), kDeltaPurpose).Reset();
    GrowDelta(*tree, delta.get());
    // In the store too, whether it was there or only here: the same bits.
    MarkDeltaDirty(cell);
  }
  return delta;
}

std::shared_ptr<ReceivedLight> CellPager::Received(CellId cell) {
  const ItemKey key{ItemKind::kReceived, cell.value};
  const size_t elements = Tree(cell)->Size();
  const auto bytes_for = [this](size_t count) {
    return ReceivedLight::BytesFor(count, shape_);
  };
  auto received = UseStored<ReceivedLight>(
      key,
      kReceivedPurpose,
      [&] { return bytes_for(elements); },
      [&] { return ReceivedLight::Load(*store_, cell, shape_, elements); });
  if (const size_t known = received->gathered.Size(); known < elements) {
    Reserve(bytes_for(elements - known), kReceivedPurpose).Reset();
    received->GrowTo(elements);
    Recharge(key, received->SizeBytes(), kReceivedPurpose);
  }
  return received;
}

std::shared_ptr<const SourceWeights> CellPager::Weights(CellId cell) {
  const ItemKey key{ItemKind::kWeights, cell.value};
  if (Find(key) == nullptr) {
    const auto geometry = Geometry(cell);
    const auto tree = Tree(cell);
    // Nothing is read for it but the tree: the best cache that the trace tells
    // of is taken to have these small things, and asks for that tree as well.
    MemoryCharge room = Reserve(
        SourceWeights::BytesFor(geometry->patches.size()), kWeightsPurpose);
    auto weights = std::make_shared<SourceWeights>(
        WeighSource({.id = cell,
                     .patches = geometry->patches,
                     .tree = tree.get(),
                     .clusters = geometry->clusters.get(),
                     .groups = &geometry->groups}));
    room.Reset();
    const uint64_t bytes = weights->SizeBytes();
    MakeRoom(bytes, kWeightsPurpose);
    Insert(key, std::move(weights), bytes);
  }
  return Use<const SourceWeights>(key);
}

void CellPager::ForgetWeights(CellId cell) {
  Forget({ItemKind::kWeights, cell.value});
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

void CellPager::MarkDirty(CellId cell) {
  MarkItemDirty<CellTree>({ItemKind::kTree, cell.value}, kTreePurpose);
}

void CellPager::MarkDeltaDirty(CellId cell) {
  MarkItemDirty<CoefficientArray>({ItemKind::kDelta, cell.value},
                                  kDeltaPurpose);
}

void CellPager::MarkReceivedDirty(CellId cell) {
  MarkItemDirty<ReceivedLight>({ItemKind::kReceived, cell.value},
                               kReceivedPurpose);
}

template <typename T>
void CellPager::MarkItemDirty(ItemKey key, std::string_view what) {
  Item* item = Find(key);
  ENFILADE_CHECK(item != nullptr && !item->use.expired(),
                 "what is changed is not in use: {}",
                 what);
  item->dirty = true;
  Recharge(key, std::static_pointer_cast<T>(item->value)->SizeBytes(), what);
}

// Of an item in use that takes `bytes` by now.
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

void CellPager::Write(ItemKey key, Item* item) {
  const CellId cell(key.cell);
  const uint64_t written_before = store_->Stats().bytes_written;
  if (key.kind == ItemKind::kTree) {
    const auto tree = std::static_pointer_cast<CellTree>(item->value);
    tree->Save(*store_, cell);
    stored_elements_[cell.Index()] = static_cast<uint32_t>(tree->Size());
  } else if (key.kind == ItemKind::kDelta) {
    const auto& delta =
        *std::static_pointer_cast<CoefficientArray>(item->value);
    SaveDelta(*store_, cell, delta);
  } else {
    std::static_pointer_cast<ReceivedLight>(item->value)->Save(*store_, cell);
  }
  trace_.SetStored(ThingOf(key),
                   store_->Stats().bytes_written - written_before);
  item->dirty = false;
}

void CellPager::Flush() {
  for (auto& [key, item] : items_) {
    if (item.dirty) {
      Write(key, &item);
    }
  }
}

}  // namespace enfilade
