#include "partition/partition.h"

#include "partition/artificial_walls.h"
#include "partition/bsp_builder.h"
#include "partition/cell_merge.h"
#include "partition/leaf_graph.h"
#include "partition/patch_writer.h"
#include "partition/portal_maker.h"
#include "partition/space_shells.h"
#include "partition/walls.h"

#include <algorithm>
#include <string>
#include <utility>

#include <fmt/format.h>

namespace enfilade {
namespace {

constexpr std::string_view kMetaName = "partition";
constexpr uint64_t kPortalsPerChunk = 4096;
// Kinds of kPortals blocks, by their second number; 1 is the tree's.
constexpr uint32_t kPortalBlock = 0;
constexpr uint32_t kRegionBlock = 2;
constexpr uint32_t kOpeningBlock = 3;
constexpr double kMarginShare = 0.01;
constexpr double kMarginM = 0.1;

// The scene's bounds, enlarged so that nothing lies in the box's own walls.
Box3 BoxAround(const Box3& bounds) {
  if (bounds.IsEmpty()) {
    return {{-1, -1, -1}, {1, 1, 1}};
  }
  const double margin = kMarginM + kMarginShare * Length(bounds.Extent());
  const Vec3 by{margin, margin, margin};
  return {bounds.low - by, bounds.high + by};
}

std::vector<CellInfo> DescribeCells(const BuiltTree& built,
                                    const LeafCells& joined) {
  std::vector<CellInfo> cells(joined.cell_count);
  for (size_t leaf = 0; leaf < built.leaves.size(); ++leaf) {
    cells[joined.cell_of_leaf[leaf].Index()].bounds.Include(
        built.leaves[leaf].bounds);
  }
  for (size_t i = 0; i < cells.size(); ++i) {
    cells[i].space = joined.space[i];
  }
  return cells;
}

// Writes portals to the store as they come.
class PortalWriter {
 public:
  PortalWriter(uint32_t kind, BlockStorage& store)
      : kind_(kind), store_(&store) {}

  void Add(const Portal& portal) {
    chunk_.PutVarint(portal.front.value);
    chunk_.PutVarint(portal.back.value);
    chunk_.PutArray(std::span<const Point3>(portal.vertices));
    if (++count_ % kPortalsPerChunk == 0) {
      Flush();
    }
  }

  // Returns how many there were.
  uint64_t Finish() {
    if (chunk_.Size() > 0) {
      Flush();
    }
    return count_;
  }

 private:
  void Flush() {
    store_->Put({BlockKind::kPortals, chunks_++, kind_}, chunk_.View());
    chunk_ = {};
  }

  uint32_t kind_;
  BlockStorage* store_;
  ByteWriter chunk_;
  uint32_t chunks_ = 0;
  uint64_t count_ = 0;
};

// The openings between leaves, each leaf a region of its own.
void SaveRegions(const BuiltTree& built,
                 const std::vector<LeafBorder>& borders,
                 const std::vector<CellId>& cell_of_region,
                 BlockStorage& store) {
  std::vector<CellId> itself;
  itself.reserve(built.leaves.size());
  for (uint32_t i = 0; i < built.leaves.size(); ++i) {
    itself.emplace_back(i);
  }
  PortalWriter openings(kOpeningBlock, store);
  ForEachPortal(built.tree, borders, itself, [&](const Portal& opening) {
    openings.Add(opening);
  });
  ByteWriter head;
  head.PutVarint(openings.Finish());
  head.PutArray(std::span<const CellId>(cell_of_region));
  store.Put({BlockKind::kPortals, 0, kRegionBlock}, head.View());
}

void SavePartition(const Partition& partition, BlockStorage& store) {
  ByteWriter head;
  head.PutVarint(partition.cells.size());
  for (const CellInfo& cell : partition.cells) {
    head.Put(cell.bounds);
    head.PutVarint(cell.patches);
    head.Put(cell.area_m2);
    head.PutVarint(cell.space ? cell.space->value + uint64_t{1} : 0);
  }
  head.Put(partition.overlap_m2);
  head.PutVarint(partition.portals.size());
  head.PutVarint(partition.notes.size());
  for (const std::string& note : partition.notes) {
    head.PutString(note);
  }
  const auto* text = reinterpret_cast<const char*>(head.View().data());
  store.SetMeta(kMetaName, {text, head.Size()});
  PortalWriter portals(kPortalBlock, store);
  for (const Portal& portal : partition.portals) {
    portals.Add(portal);
  }
  portals.Finish();
}

// Beside its corners, in an array that has grown to hold it.
constexpr uint64_t kPortalBytes = 2 * sizeof(Portal) + kAllocationHeaderBytes;
// Beside its corners in the store, at most: three small numbers.
constexpr uint64_t kStoredPortalBytes = 16;

// `read`, unless empty, is told of the size of each piece before its portals.
void VisitPortals(const BlockStorage& store,
                  uint32_t kind,
                  uint64_t count,
                  const std::function<void(uint64_t)>& read,
                  const std::function<void(Portal&&)>& visit) {
  uint64_t visited = 0;
  for (uint32_t chunk = 0; visited < count; ++chunk) {
    const Bytes bytes = store.GetOrThrow({BlockKind::kPortals, chunk, kind});
    if (read) {
      read(bytes.size());
    }
    ByteReader reader(bytes);
    if (reader.AtEnd()) {
      throw DamagedStoreError("a stored piece of the portals is empty");
    }
    while (!reader.AtEnd()) {
      Portal portal;
      portal.front = CellId(static_cast<uint32_t>(reader.GetVarint()));
      portal.back = CellId(static_cast<uint32_t>(reader.GetVarint()));
      portal.vertices = reader.GetArray<Point3>();
      visit(std::move(portal));
      ++visited;
    }
  }
}

std::vector<Portal> LoadPortals(const BlockStorage& store,
                                uint32_t kind,
                                uint64_t count,
                                const std::function<void(uint64_t)>& reserve) {
  std::vector<Portal> portals;
  uint64_t corner_bytes = 0;
  const auto read = [&](uint64_t bytes) {
    corner_bytes += bytes;
    if (reserve) {
      reserve(count * kPortalBytes + corner_bytes);
    }
  };
  VisitPortals(store, kind, count, read, [&](Portal&& portal) {
    portals.push_back(std::move(portal));
  });
  return portals;
}

class StageProgress {
 public:
  explicit StageProgress(const PartitionOptions& options)
      : options_(&options) {}

  void Reach(double fraction) const {
    if (options_->progress) {
      options_->progress(fraction);
    }
  }

 private:
  const PartitionOptions* options_;
};

void NoteTouches(const TouchCounts& counts, std::vector<std::string>& notes) {
  const OverlapCounts& overlaps = counts.overlaps;
  if (overlaps.dropped > 0) {
    notes.push_back(fmt::format(
        "{} patches were there twice, whole or in part: {:.3g} m2 were dropped",
        overlaps.dropped,
        overlaps.area_m2));
  }
  if (overlaps.moved > 0) {
    notes.push_back(fmt::format(
        "{} patches lay in larger ones and were put {} mm before them",
        overlaps.moved,
        1e3 * kApartM));
  }
  if (counts.contacts.cut > 0 || counts.contacts.covered_m2 > 0) {
    notes.push_back(fmt::format(
        "{} patches were cut where others stand or lie on them; {:.3g} m2 are "
        "covered",
        counts.contacts.cut,
        counts.contacts.covered_m2));
  }
}

}  // namespace

Partition BuildPartition(BlockStorage& store,
                         const PartitionOptions& options,
                         MemoryBudget& budget) {
  const StageProgress progress(options);
  const SceneInfo info = LoadSceneInfo(store);
  bool all_split = false;
  BuiltTree built = [&] {
    FragmentShelf shelf(store, budget);
    Walls walls = GatherWalls(store, info, budget, shelf);
    all_split = walls.rules.all_split;
    progress.Reach(0.1);
    BuiltTree tree =
        BuildTree(BoxAround(info.bounds), std::move(walls), shelf, budget);
    shelf.Clear();
    return tree;
  }();
  progress.Reach(0.4);
  const FaceSurvey survey =
      RelieveCrowdedLeaves(store, options.max_cell_patches, budget, built);
  built.charge.Reset();
  built.charge =
      MemoryCharge(budget, BytesOf(built), "the tree of splitting planes");
  GrowingCharge borders_charge(budget, "the borders between convex regions");
  const std::vector<LeafBorder> borders =
      FindOpenBorders(store, built, survey, budget, borders_charge);
  FreeVector(&built.sections);
  built.charge.ShrinkTo(BytesOf(built));
  // Twice: cells are joined, and portals made, by what is open.
  borders_charge.ShrinkTo(2 * BytesOf(borders));
  borders_charge.GrowTo(2 * BytesOf(borders));
  progress.Reach(0.6);
  std::vector<std::optional<SpaceId>> spaces;
  if (!info.spaces.empty()) {
    spaces = SpacesOfLeaves(store, info, built.leaves, budget);
  }
  const LeafCells joined =
      JoinLeaves({built, survey, borders, spaces, all_split}, options);
  Partition partition;
  partition.cells = DescribeCells(built, joined);
  ForEachPortal(
      built.tree, borders, joined.cell_of_leaf, [&partition](Portal portal) {
        partition.portals.push_back(std::move(portal));
      });
  SaveRegions(built, borders, joined.cell_of_leaf, store);
  progress.Reach(0.7);
  SaveTree(built.tree, joined.cell_of_leaf, store);
  const TouchCounts touches = WritePatches(
      info, built.tree, joined.cell_of_leaf, budget, store, partition.cells);
  partition.overlap_m2 = touches.overlaps.area_m2;
  NoteTouches(touches, partition.notes);
  partition.notes.push_back(
      fmt::format("split into {} convex regions, joined into {} cells with {} "
                  "portals",
                  built.leaves.size(),
                  partition.cells.size(),
                  partition.portals.size()));
  SavePartition(partition, store);
  progress.Reach(1);
  return partition;
}

Partition LoadWithoutPortals(const BlockStorage& store, uint64_t* portals) {
  const auto text = store.Meta(kMetaName);
  if (!text) {
    throw DamagedStoreError(
        "the store holds no cells: its partition was never finished; solve "
        "the scene again");
  }
  ByteReader head(std::as_bytes(std::span<const char>(*text)));
  Partition partition;
  partition.cells.resize(head.GetVarint());
  for (CellInfo& cell : partition.cells) {
    cell.bounds = head.Get<Box3>();
    cell.patches = static_cast<uint32_t>(head.GetVarint());
    cell.area_m2 = head.Get<double>();
    const uint64_t space = head.GetVarint();
    if (space > 0) {
      cell.space = SpaceId(static_cast<uint32_t>(space - 1));
    }
  }
  partition.overlap_m2 = head.Get<double>();
  const uint64_t portal_count = head.GetVarint();
  if (portals != nullptr) {
    *portals = portal_count;
  }
  partition.notes.resize(head.GetVarint());
  for (std::string& note : partition.notes) {
    note = head.GetString();
  }
  return partition;
}

Partition LoadPartition(const BlockStorage& store,
                        const std::function<void(uint64_t)>& reserve) {
  uint64_t portals = 0;
  Partition partition = LoadWithoutPortals(store, &portals);
  partition.portals = LoadPortals(store, kPortalBlock, portals, reserve);
  return partition;
}

std::vector<CellInfo> LoadCells(const BlockStorage& store) {
  return LoadWithoutPortals(store).cells;
}

void ForEachPortal(const BlockStorage& store,
                   const std::function<void(const Portal&)>& visit) {
  uint64_t portals = 0;
  LoadWithoutPortals(store, &portals);
  VisitPortals(store, kPortalBlock, portals, {}, visit);
}

uint64_t BytesOf(const Portal& portal) {
  return kPortalBytes + kStoredPortalBytes +
         portal.vertices.size() * sizeof(Point3);
}

std::optional<Regions> LoadRegions(
    const BlockStorage& store, const std::function<void(uint64_t)>& reserve) {
  const auto block = store.Get({BlockKind::kPortals, 0, kRegionBlock});
  if (!block) {
    return std::nullopt;
  }
  ByteReader head(*block);
  Regions regions;
  const uint64_t openings = head.GetVarint();
  regions.cell_of = head.GetArray<CellId>();
  regions.openings = LoadPortals(store, kOpeningBlock, openings, reserve);
  return regions;
}

}  // namespace enfilade
