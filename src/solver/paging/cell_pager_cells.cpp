// The part of the pager that makes items from stored cells, or reads them.

#include "base/check.h"
#include "base/error.h"
#include "partition/patch.h"
#include "solver/elements/cell_delta.h"
#include "solver/paging/cell_pager.h"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

namespace enfilade {
namespace {

constexpr std::string_view kGeometryPurpose = "the geometry of a cell";
constexpr std::string_view kTreePurpose = "the element trees of a cell";
constexpr std::string_view kDeltaPurpose = "what a cell has sent last";
constexpr std::string_view kReceivedPurpose = "what a cell has received";
constexpr std::string_view kWeightsPurpose = "what a cell sends at most";

}  // namespace

// Uses an item; if it is not in memory, `read` takes it from the store. Room of
// `bytes()` is made first, because nothing charges the item while it is read.
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

std::shared_ptr<const CellGeometry> CellPager::Geometry(CellId cell) {
  const ItemKey key{ItemKind::kGeometry, cell.value};
  if (Find(key) == nullptr) {
    // Makes room first for the patches and for the work space of making
    // geometry.
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

// Reads the patches of a cell, from which items of the kinds `made` will be
// made.
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
  // The room includes the patches while the obstacles are made from them.
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
  // Embree charges the budget itself; MakeRoom here only makes the room.
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
  // Pinned items cannot be evicted when the memory of the process comes near
  // the cap.
  return CanFree(need + build + budget_->ResidentBeyondCharges());
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
    Drop(elements);  // the tree may change from now on
  }
  const auto geometry = Geometry(cell);
  const auto& patches = geometry->patches;
  return UseStored<CellTree>(
      key,
      kTreePurpose,
      [&] {
        return CellTree::BytesFor(
            std::max(StoredElements(cell), patches.size()), shape_);
      },
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
        auto elements =
            CellTree::LoadElements(*store_, cell, shape_, geometry->patches);
        if (!elements) {
          throw DamagedStoreError(fmt::format(
              "the store lacks the element tree of cell {}", cell.value));
        }
        return std::move(*elements);
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
    // The grown delta must reach the store, whether the delta came from there
    // or was only in memory: the bits are the same either way.
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
  if (Find(key) == nullptr && !HasSourceWeights(*store_, cell)) {
    RenewWeights(cell);  // the cell has not had its turn
  }
  const auto geometry = Geometry(cell);
  return UseStored<SourceWeights>(
      key,
      kWeightsPurpose,
      [&] { return SourceWeights::BytesFor(geometry->patches.size()); },
      [&] { return LoadSourceWeights(*store_, cell, *geometry); });
}

void CellPager::RenewWeights(CellId cell) {
  const ItemKey key{ItemKind::kWeights, cell.value};
  const auto geometry = Geometry(cell);
  const auto tree = Tree(cell);
  MemoryCharge room = Reserve(SourceWeights::BytesFor(geometry->patches.size()),
                              kWeightsPurpose);
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
  items_.at(key).dirty = true;
  NoteCapacity();
  trace_.Make(ThingOf(key));
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

}  // namespace enfilade
