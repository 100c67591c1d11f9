#include "solver/cell_pager.h"

#include "base/check.h"
#include "partition/patch.h"

#include <algorithm>
#include <utility>

namespace enfilade {
namespace {

// Patches may stick out of their cell by this much (overlap.h), m.
constexpr double kBoundsMargin = 5e-3;

}  // namespace

uint64_t CellGeometry::SizeBytes() const {
  return patches.size() * sizeof(PatchGeometry) + portals->SizeBytes() +
         clusters->SizeBytes() + groups.SizeBytes();
}

uint64_t CellGeometry::BytesFor(size_t patches, size_t portal_triangles) {
  return patches * sizeof(PatchGeometry) +
         ShaftBlockers::BytesFor(portal_triangles) +
         ClusterTree::HeldBytesFor(patches) + SourceGroups::BytesFor(patches);
}

SurfaceTable MakeSurfaceTable(const SceneInfo& scene) {
  SurfaceTable table;
  for (const Material& m : scene.materials) {
    for (size_t c = 0; c < kRgbChannels; ++c) {
      table.reflectance.push_back(static_cast<float>(m.reflectance[c]));
      table.exitance.push_back(static_cast<float>(m.exitance[c]));
    }
  }
  return table;
}

CellPager::CellPager(BlockStorage& store,
                     const SceneInfo& scene,
                     const Partition& partition,
                     TreeShape shape,
                     const OcclusionDevice& device,
                     MemoryBudget& budget)
    : store_(&store),
      scene_(&scene),
      partition_(&partition),
      portals_of_(partition.cells.size()),
      surfaces_(MakeSurfaceTable(scene)),
      shape_(shape),
      device_(&device),
      budget_(&budget),
      origin_(device.Origin()),
      trace_(budget.LimitBytes()),
      next_use_(store, partition.cells.size(), budget) {
  for (size_t i = 0; i < partition.portals.size(); ++i) {
    portals_of_[partition.portals[i].front.Index()].emplace_back(i);
    portals_of_[partition.portals[i].back.Index()].emplace_back(i);
  }
}

std::unique_ptr<ShaftBlockers> CellPager::PortalsOf(CellId cell) const {
  std::vector<PatchGeometry> triangles;
  for (const PortalId id : portals_of_[cell.Index()]) {
    const auto& v = partition_->portals[id.Index()].vertices;
    for (size_t i = 1; i + 1 < v.size(); ++i) {
      Patch patch;
      patch.origin = v[0];
      patch.u = v[i] - v[0];
      patch.v = v[i + 1] - v[0];
      patch.shape = PatchShape::kTriangle;
      if (Length(Cross(patch.u, patch.v)) > 0) {
        triangles.push_back(MakePatchGeometry(patch, Material{}, origin_));
      }
    }
  }
  return std::make_unique<ShaftBlockers>(triangles);
}

CellPager::~CellPager() {
  for (auto& [key, item] : items_) {
    budget_->Release(item.charged_bytes);
  }
}

BlockKey CellPager::BlockOf(ItemKey key) {
  return {key.first == ItemKind::kTree ? BlockKind::kCellTree
                                       : BlockKind::kCellPatches,
          key.second};
}

CellPager::Item* CellPager::Find(ItemKey key) {
  const auto it = items_.find(key);
  if (it == items_.end()) {
    return nullptr;
  }
  it->second.last_use = ++clock_;
  trace_.RecordHit(BlockOf(key));
  return &it->second;
}

CellPager::Item& CellPager::Insert(ItemKey key,
                                   std::shared_ptr<void> value,
                                   uint64_t bytes) {
  Item& item = items_[key];
  item.value = std::move(value);
  item.charged_bytes = bytes;
  item.last_use = ++clock_;
  return item;
}

std::shared_ptr<const CellGeometry> CellPager::Geometry(CellId cell) {
  const ItemKey key{ItemKind::kGeometry, cell.value};
  if (const Item* item = Find(key)) {
    return std::static_pointer_cast<const CellGeometry>(item->value);
  }
  const CellPatches stored = ReadPatches(cell);
  auto geometry = std::make_shared<CellGeometry>();
  geometry->patches.reserve(stored.patches.size());
  for (const Patch& patch : stored.patches) {
    geometry->patches.push_back(MakePatchGeometry(
        patch, scene_->materials.at(patch.material.Index()), origin_));
  }
  geometry->portals = PortalsOf(cell);
  geometry->clusters = std::make_unique<ClusterTree>(
      geometry->patches, WholePatches(geometry->patches.size()));
  if (!shape_.basis->HasOwnNodes()) {
    geometry->groups = SourceGroups(geometry->patches);
  }
  const uint64_t bytes = geometry->SizeBytes();
  MakeRoom(bytes, "the geometry of a cell");
  Insert(key, geometry, bytes);
  return geometry;
}

CellPatches CellPager::ReadPatches(CellId cell) {
  const uint64_t read_before = store_->Stats().bytes_read;
  CellPatches stored = LoadCellPatches(*store_, cell);
  trace_.Record(BlockOf({ItemKind::kGeometry, cell.value}),
                store_->Stats().bytes_read - read_before);
  return stored;
}

std::shared_ptr<const ShaftBlockers> CellPager::Obstacles(CellId cell) {
  if (const Item* item = Find({ItemKind::kObstacles, cell.value})) {
    return std::static_pointer_cast<const ShaftBlockers>(item->value);
  }
  return MakeObstacles(cell, ReadPatches(cell));
}

std::shared_ptr<const CellBlockers> CellPager::Occluder(CellId cell) {
  if (const Item* item = Find({ItemKind::kOccluder, cell.value})) {
    return std::static_pointer_cast<const CellBlockers>(item->value);
  }
  return MakeOccluder(cell, ReadPatches(cell));
}

CellPager::CellObstructions CellPager::Obstructions(CellId cell) {
  if (items_.contains({ItemKind::kObstacles, cell.value}) ||
      items_.contains({ItemKind::kOccluder, cell.value})) {
    return {Obstacles(cell), Occluder(cell)};
  }
  const CellPatches stored = ReadPatches(cell);
  return {MakeObstacles(cell, stored), MakeOccluder(cell, stored)};
}

std::shared_ptr<const ShaftBlockers> CellPager::MakeObstacles(
    CellId cell, const CellPatches& stored) {
  // The patches too, while the obstacles are made of them.
  const size_t count = BlockerCount(stored);
  const uint64_t bytes = ShaftBlockers::BytesFor(count);
  MemoryCharge work =
      Reserve(bytes + count * sizeof(PatchGeometry), "the blockers of a cell");
  std::vector<PatchGeometry> blockers;
  blockers.reserve(count);
  for (const Patch& patch : stored.patches) {
    if (!patch.is_twin) {
      blockers.push_back(MakePatchGeometry(
          patch, scene_->materials.at(patch.material.Index()), origin_));
    }
  }
  auto obstacles = std::make_shared<ShaftBlockers>(blockers);
  work.Reset();
  MakeRoom(obstacles->SizeBytes(), "the blockers of a cell");
  Insert({ItemKind::kObstacles, cell.value}, obstacles, obstacles->SizeBytes());
  return obstacles;
}

std::shared_ptr<const CellBlockers> CellPager::MakeOccluder(
    CellId cell, const CellPatches& stored) {
  // Embree charges the budget itself; this only makes the room.
  const uint64_t estimate = BlockersBuildBytes(BlockerCount(stored));
  MakeRoom(estimate, "the blockers of a cell");
  budget_->Release(estimate);
  std::shared_ptr<const CellBlockers> blockers = device_->Build(stored);
  Insert({ItemKind::kOccluder, cell.value},
         std::const_pointer_cast<CellBlockers>(blockers),
         0);
  return blockers;
}

uint64_t CellPager::BytesOf(ItemKey key, const Item& item) {
  return key.first == ItemKind::kOccluder
             ? BlockersBytes(
                   *std::static_pointer_cast<const CellBlockers>(item.value))
             : item.charged_bytes;
}

bool CellPager::CanHoldBlockers(const std::vector<CellId>& cells) const {
  uint64_t need = 0;
  uint64_t build = 0;
  for (const CellId cell : cells) {
    const size_t patches = partition_->cells[cell.Index()].patches;
    const auto add = [&](ItemKind kind, uint64_t bytes, uint64_t more) {
      const auto it = items_.find({kind, cell.value});
      const bool is_here = it != items_.end();
      need += is_here ? BytesOf(it->first, it->second) : bytes;
      build = std::max(build, is_here ? 0 : more);
    };
    const uint64_t held = BlockersHeldBytes(patches);
    add(ItemKind::kObstacles,
        ShaftBlockers::BytesFor(patches),
        patches * sizeof(PatchGeometry));
    add(ItemKind::kOccluder, held, BlockersBuildBytes(patches) - held);
  }
  need += build;
  uint64_t room = budget_->FreeBytes();
  if (need <= room) {
    return true;
  }
  for (const auto& [key, item] : items_) {
    room += item.value.use_count() > 1 ? 0 : BytesOf(key, item);
  }
  return need <= room;
}

Box CellPager::BoundsOf(CellId cell) const {
  const Box3& bounds = partition_->cells[cell.Index()].bounds;
  const Vec3 margin{kBoundsMargin, kBoundsMargin, kBoundsMargin};
  const Vec3 low = bounds.low - margin - origin_;
  const Vec3 high = bounds.high + margin - origin_;
  Box box;
  box.Add(Vec3f{static_cast<float>(low.x),
                static_cast<float>(low.y),
                static_cast<float>(low.z)});
  box.Add(Vec3f{static_cast<float>(high.x),
                static_cast<float>(high.y),
                static_cast<float>(high.z)});
  return box;
}

std::shared_ptr<CellTree> CellPager::Tree(CellId cell) {
  const ItemKey key{ItemKind::kTree, cell.value};
  if (const Item* item = Find(key)) {
    return std::static_pointer_cast<CellTree>(item->value);
  }
  const auto geometry = Geometry(cell);
  std::shared_ptr<CellTree> tree;
  const uint64_t read_before = store_->Stats().bytes_read;
  // Room first: the tree is not in anybody's charge while it is read.
  const uint64_t expected =
      CellTree::BytesFor(CellTree::StoredSize(*store_, cell), shape_);
  MemoryCharge room = Reserve(expected, "the element trees of a cell");
  if (auto stored = CellTree::Load(*store_, cell, shape_, geometry->patches)) {
    tree = std::make_shared<CellTree>(std::move(*stored));
  } else {
    tree = std::make_shared<CellTree>(shape_, geometry->patches);
    tree->Sent() = EmittedRadiosity(*tree, geometry->patches, surfaces_);
  }
  trace_.Record(BlockOf(key), store_->Stats().bytes_read - read_before);
  room.Reset();
  MakeRoom(tree->SizeBytes(), "the element trees of a cell");
  Insert(key, tree, tree->SizeBytes());
  return tree;
}

void CellPager::MarkDirty(CellId cell) {
  Item* item = Find({ItemKind::kTree, cell.value});
  ENFILADE_CHECK(item != nullptr, "cell {} is not in memory", cell.value);
  item->dirty = true;
  const uint64_t bytes =
      std::static_pointer_cast<CellTree>(item->value)->SizeBytes();
  if (bytes > item->charged_bytes) {
    const std::shared_ptr<void> pin = item->value;
    const uint64_t more = bytes - item->charged_bytes;
    MakeRoom(more, "the element trees of a cell");
    Find({ItemKind::kTree, cell.value})->charged_bytes += more;
  } else {
    budget_->Release(item->charged_bytes - bytes);
    item->charged_bytes = bytes;
  }
}

void CellPager::WriteTree(CellId cell, Item* item) {
  std::static_pointer_cast<CellTree>(item->value)->Save(*store_, cell);
  item->dirty = false;
}

void CellPager::Flush() {
  for (auto& [key, item] : items_) {
    if (item.dirty) {
      WriteTree(CellId(key.second), &item);
    }
  }
}

void CellPager::Drop(std::map<ItemKey, Item>::iterator item) {
  if (item->second.dirty) {
    WriteTree(CellId(item->first.second), &item->second);
  }
  item->second.value.reset();
  budget_->Release(item->second.charged_bytes);
  items_.erase(item);
}

bool CellPager::EvictOne() {
  auto victim = items_.end();
  std::pair<uint64_t, uint64_t> last;
  for (auto it = items_.begin(); it != items_.end(); ++it) {
    if (it->second.value.use_count() > 1) {
      continue;
    }
    // Of those needed last together, the one that was used longest ago.
    const std::pair next{next_use_.Distance(CellId(it->first.second)),
                         clock_ - it->second.last_use};
    if (victim == items_.end() || next > last) {
      victim = it;
      last = next;
    }
  }
  if (victim == items_.end()) {
    return false;
  }
  Drop(victim);
  return true;
}

void CellPager::EvictAll() {
  while (EvictOne()) {
  }
  ReleaseFreedMemory();
}

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

}  // namespace enfilade
