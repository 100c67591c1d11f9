#include "solver/paging/cell_pager.h"

#include "base/check.h"
#include "base/error.h"
#include "partition/patch.h"
#include "solver/elements/cell_delta.h"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

namespace enfilade {
namespace {

constexpr std::string_view kGeometryPurpose = "the geometry of a cell";
constexpr std::string_view kBlockersPurpose = "the blockers of a cell";
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
      pairs_(store, partition.cells.size(), budget),
      order_(pairs_, budget),
      items_(order_,
             budget,
             [this](const ItemKey& key, const void* value) {
               return Save(key, value);
             }),
      links_(store, items_) {}

// Uses an item; if it is not in memory, `read` takes it from the store. Room of
// `bytes()` is made first, because nothing charges the item while it is read.
template <typename T, typename Bytes, typename Read>
std::shared_ptr<T> CellPager::UseStored(const ItemKey& key,
                                        std::string_view what,
                                        const Bytes& bytes,
                                        const Read& read) {
  if (!items_.Has(key)) {
    const uint64_t read_before = store_->Stats().bytes_read;
    MemoryCharge room = items_.Reserve(bytes(), what);
    auto value = std::make_shared<T>(read());
    const uint64_t read_bytes = store_->Stats().bytes_read - read_before;
    items_.Trace().AddRead(read_bytes);
    room.Reset();
    const uint64_t held = value->SizeBytes();
    items_.MakeRoom(held, what);
    items_.Insert(key, std::move(value), {held, held, read_bytes});
  }
  return items_.Use<T>(key);
}

std::shared_ptr<const CellGeometry> CellPager::Geometry(CellId cell) {
  const ItemKey key{ItemKind::kGeometry, cell.value};
  if (!items_.Has(key)) {
    // Makes room first for the patches and for the work space of making
    // geometry.
    MemoryCharge room = items_.ReserveIfPossible(maker_.GeometryWorkBytes(cell),
                                                 kGeometryPurpose);
    const ReadCell read = ReadPatches(cell);
    auto geometry = std::make_shared<CellGeometry>(
        maker_.MakeGeometry(cell, read.patches, !shape_.basis->HasOwnNodes()));
    room.Reset();
    const uint64_t bytes = geometry->SizeBytes();
    items_.MakeRoom(bytes, kGeometryPurpose);
    items_.Insert(key, std::move(geometry), {bytes, bytes, read.bytes});
  }
  return items_.Use<const CellGeometry>(key);
}

CellPager::ReadCell CellPager::ReadPatches(CellId cell) {
  const uint64_t read_before = store_->Stats().bytes_read;
  ReadCell read{LoadCellPatches(*store_, cell), 0};
  read.bytes = store_->Stats().bytes_read - read_before;
  items_.Trace().AddRead(read.bytes);
  return read;
}

std::shared_ptr<const ShaftBlockers> CellPager::ShaftBlockersOf(CellId cell) {
  const ItemKey key{ItemKind::kShaftBlockers, cell.value};
  if (!items_.Has(key)) {
    MakeShaftBlockers(cell, ReadPatches(cell));
  }
  return items_.Use<const ShaftBlockers>(key);
}

std::shared_ptr<const RayBlockers> CellPager::RayBlockersOf(CellId cell) {
  const ItemKey key{ItemKind::kRayBlockers, cell.value};
  if (!items_.Has(key)) {
    MakeRayBlockers(cell, ReadPatches(cell));
  }
  return items_.Use<const RayBlockers>(key);
}

CellPager::CellBlockers CellPager::BlockersOf(CellId cell) {
  const ItemKey of_shafts{ItemKind::kShaftBlockers, cell.value};
  const ItemKey of_rays{ItemKind::kRayBlockers, cell.value};
  CellBlockers both;
  both.shafts = items_.Use<const ShaftBlockers>(of_shafts);
  if (both.shafts == nullptr || !items_.Has(of_rays)) {
    const ReadCell read = ReadPatches(cell);
    if (both.shafts == nullptr) {
      MakeShaftBlockers(cell, read);
      both.shafts = items_.Use<const ShaftBlockers>(of_shafts);
    }
    if (!items_.Has(of_rays)) {
      MakeRayBlockers(cell, read);
    }
  }
  both.rays = items_.UseAlong<const RayBlockers>(of_rays);
  return both;
}

void CellPager::MakeShaftBlockers(CellId cell, const ReadCell& read) {
  // The room includes the patches while the blockers are made from them.
  const size_t count = BlockerCount(read.patches);
  const uint64_t room = ShaftBlockers::BytesFor(count);
  MemoryCharge work =
      items_.Reserve(room + count * sizeof(PatchGeometry), kBlockersPurpose);
  auto blockers =
      std::make_shared<ShaftBlockers>(maker_.MakeShaftBlockers(read.patches));
  work.Reset();
  const uint64_t bytes = blockers->SizeBytes();
  items_.MakeRoom(bytes, kBlockersPurpose);
  items_.Insert({ItemKind::kShaftBlockers, cell.value},
                std::move(blockers),
                {bytes, bytes, read.bytes});
}

void CellPager::MakeRayBlockers(CellId cell, const ReadCell& read) {
  // Embree charges the budget itself; MakeRoom here only makes the room.
  const uint64_t estimate = BlockersBuildBytes(BlockerCount(read.patches));
  items_.MakeRoom(estimate, kBlockersPurpose);
  budget_->Release(estimate);
  const std::shared_ptr<const RayBlockers> blockers =
      device_->Build(read.patches);
  items_.Insert({ItemKind::kRayBlockers, cell.value},
                std::const_pointer_cast<RayBlockers>(blockers),
                {BlockersBytes(*blockers), 0, read.bytes});
}

bool CellPager::CanHoldBlockers(const std::vector<CellId>& cells) const {
  uint64_t need = 0;
  uint64_t build = 0;
  for (const CellId cell : cells) {
    const size_t patches = partition_->cells[cell.Index()].patches;
    const auto add = [&](ItemKind kind, uint64_t bytes, uint64_t more) {
      const uint64_t held = items_.HeldBytes({kind, cell.value});
      need += held > 0 ? held : bytes;
      build = std::max(build, held > 0 ? 0 : more);
    };
    const uint64_t held = BlockersHeldBytes(patches);
    add(ItemKind::kShaftBlockers,
        ShaftBlockers::BytesFor(patches),
        patches * sizeof(PatchGeometry));
    add(ItemKind::kRayBlockers, held, BlockersBuildBytes(patches) - held);
  }
  // Pinned items cannot be evicted when the memory of the process comes near
  // the cap.
  return items_.CanFree(need + build + budget_->ResidentBeyondCharges());
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
  if (items_.Has(key)) {
    return items_.Use<CellTree>(key);
  }
  // The tree may change from now on.
  items_.Forget({ItemKind::kElements, cell.value});
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
  if (items_.Has({ItemKind::kTree, cell.value})) {
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
          ThrowDamaged(
              *store_,
              fmt::format("lacks the element tree of cell {}", cell.value));
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
    items_.Reserve(bytes_for(tree->Size() - delta->Size()), kDeltaPurpose)
        .Reset();
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
    items_.Reserve(bytes_for(elements - known), kReceivedPurpose).Reset();
    received->GrowTo(elements);
    items_.Resize(key, received->SizeBytes(), kReceivedPurpose);
  }
  return received;
}

std::shared_ptr<const SourceWeights> CellPager::Weights(CellId cell) {
  const ItemKey key{ItemKind::kWeights, cell.value};
  if (!items_.Has(key) && !HasSourceWeights(*store_, cell)) {
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
  MemoryCharge room = items_.Reserve(
      SourceWeights::BytesFor(geometry->patches.size()), kWeightsPurpose);
  auto weights = std::make_shared<SourceWeights>(
      WeighSource({.id = cell,
                   .patches = geometry->patches,
                   .clusters = geometry->clusters.get(),
                   .groups = &geometry->groups},
                  *tree));
  room.Reset();
  const uint64_t bytes = weights->SizeBytes();
  items_.MakeRoom(bytes, kWeightsPurpose);
  items_.InsertChanged(key, std::move(weights), {bytes, bytes, 0});
}

void CellPager::ForgetWeights(CellId cell) {
  items_.Forget({ItemKind::kWeights, cell.value});
  EraseSourceWeights(*store_, cell);
}

void CellPager::ForgetDelta(CellId cell) {
  items_.Forget({ItemKind::kDelta, cell.value});
  EraseDelta(*store_, cell);
}

template <typename T>
void CellPager::MarkItemDirty(const ItemKey& key, std::string_view what) {
  items_.MarkChanged(key, items_.InUse<T>(key, what).SizeBytes(), what);
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

uint64_t CellPager::Save(const ItemKey& key, const void* value) {
  const CellId cell = key.Cell();
  switch (key.kind) {
    case ItemKind::kTree: {
      const auto& tree = *static_cast<const CellTree*>(value);
      stored_elements_[cell.Index()] = static_cast<uint32_t>(tree.Size());
      return tree.Save(*store_, cell);
    }
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

}  // namespace enfilade
