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
#include <deque>
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
constexpr BlockKey kRegionKey{BlockKind::kPortals, 0, kRegionBlock};
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
                 const OpenBorders& borders,
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
  store.Put(kRegionKey, head.View());
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

// Splits space into convex regions and joins these into cells.
class SpaceCutter {
 public:
  SpaceCutter(const SceneInfo& info,
              const PartitionOptions& options,
              MemoryBudget& budget,
              BlockStorage& store)
      : info_(&info), options_(&options), budget_(&budget), store_(&store) {}

  void BuildRegions(const StageProgress& progress) {
    ScratchShelf shelf(*store_, *budget_, "the walls while cells are found");
    Walls walls = GatherWalls(*store_, *info_, *budget_, shelf);
    all_split_ = walls.rules.all_split;
    progress.Reach(0.1);
    built_ =
        BuildTree(BoxAround(info_->bounds), std::move(walls), shelf, *budget_);
    shelf.Clear();
    progress.Reach(0.4);
  }

  // Adds cells and portals to the partition, and stores the regions.
  void JoinRegions(const StageProgress& progress,
                   GrowingCharge& portals_charge,
                   Partition* partition) {
    const FaceSurvey survey = RelieveCrowdedLeaves(
        *store_, options_->max_cell_patches, *budget_, built_);
    built_.charge.Reset();
    built_.charge =
        MemoryCharge(*budget_, BytesOf(built_), "the tree of splitting planes");
    ScratchShelf shelf(
        *store_, *budget_, "the openings between convex regions");
    {
      GrowingCharge charge(*budget_, "the borders between convex regions");
      const OpenBorders borders =
          FindOpenBorders(*store_, built_, survey, shelf, *budget_, charge);
      std::deque<Polygon>().swap(built_.sections);
      for (LeafShape& leaf : built_.leaves) {
        FreeVector(&leaf.corners);
      }
      built_.charge.ShrinkTo(BytesOf(built_));
      charge.ShrinkTo(borders.Bytes());
      progress.Reach(0.6);
      const LeafCells joined = Join(survey, borders.All());
      cell_of_leaf_ = joined.cell_of_leaf;
      partition->cells = DescribeCells(built_, joined);
      MakePortals(borders, portals_charge, partition);
    }
    shelf.Clear();
    LeafShapes().swap(built_.leaves);
    built_.charge.ShrinkTo(BytesOf(built_));
    progress.Reach(0.7);
    SaveTree(built_.tree, cell_of_leaf_, *store_);
  }

  [[nodiscard]] const BspTree& Tree() const { return built_.tree; }

  [[nodiscard]] const std::vector<CellId>& CellOfLeaf() const {
    return cell_of_leaf_;
  }

 private:
  [[nodiscard]] LeafCells Join(const FaceSurvey& survey,
                               const LeafBorders& borders) const {
    std::vector<std::optional<SpaceId>> spaces;
    if (!info_->spaces.empty()) {
      spaces = SpacesOfLeaves(*store_, *info_, built_.leaves, *budget_);
    }
    const MemoryCharge charge(*budget_,
                              BytesToJoin(built_.leaves.size(), borders.size()),
                              "convex regions that are joined");
    return JoinLeaves({built_, survey, borders, spaces, all_split_}, *options_);
  }

  void MakePortals(const OpenBorders& borders,
                   GrowingCharge& portals_charge,
                   Partition* partition) {
    constexpr uint64_t kCopies = 3;  // sorted, joined, a hull
    const MemoryCharge charge(*budget_,
                              kCopies * borders.MostBytesOfNode(),
                              "the openings in one plane");
    uint64_t portal_bytes = 0;
    ForEachPortal(built_.tree, borders, cell_of_leaf_, [&](Portal portal) {
      portal_bytes += BytesOf(portal);
      portals_charge.GrowTo(portal_bytes);
      partition->portals.push_back(std::move(portal));
    });
    SaveRegions(built_, borders, cell_of_leaf_, *store_);
  }

  const SceneInfo* info_;
  const PartitionOptions* options_;
  MemoryBudget* budget_;
  BlockStorage* store_;
  bool all_split_ = false;
  BuiltTree built_;
  std::vector<CellId> cell_of_leaf_;
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
  Partition partition;
  GrowingCharge portals_charge(budget, "the doorways of the building");
  SpaceCutter cutter(info, options, budget, store);
  cutter.BuildRegions(progress);
  cutter.JoinRegions(progress, portals_charge, &partition);
  const TouchCounts touches = WritePatches(
      info, cutter.Tree(), cutter.CellOfLeaf(), budget, store, partition.cells);
  partition.overlap_m2 = touches.overlaps.area_m2;
  NoteTouches(touches, partition.notes);
  partition.notes.push_back(
      fmt::format("split into {} convex regions, joined into {} cells with {} "
                  "portals",
                  cutter.Tree().leaf_count,
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

std::optional<std::vector<CellId>> LoadRegionCells(const BlockStorage& store) {
  const auto block = store.Get(kRegionKey);
  if (!block) {
    return std::nullopt;
  }
  ByteReader head(*block);
  head.GetVarint();  // openings
  return head.GetArray<CellId>();
}

void ForEachOpening(const BlockStorage& store,
                    const std::function<void(const Portal&)>& visit) {
  const Bytes block = store.GetOrThrow(kRegionKey);
  const uint64_t openings = ByteReader(block).GetVarint();
  VisitPortals(store, kOpeningBlock, openings, {}, visit);
}

}  // namespace enfilade
