#include "partition/partition_store.h"

#include "base/bytes.h"
#include "base/error.h"

#include <span>
#include <string>
#include <string_view>
#include <utility>

namespace enfilade {
namespace {

constexpr std::string_view kMetaName = "partition";
constexpr uint64_t kPortalsPerChunk = 4096;
// Kinds of kPortals blocks, by the second number of their key; 1 is the tree's.
constexpr uint32_t kPortalBlock = 0;
constexpr uint32_t kRegionBlock = 2;
constexpr uint32_t kOpeningBlock = 3;
constexpr BlockKey kRegionKey{BlockKind::kPortals, 0, kRegionBlock};

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

  // Returns how many portals were added.
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

// The bytes of a portal without its corners, in an array that has grown to hold
// it.
constexpr uint64_t kPortalBytes = 2 * sizeof(Portal) + kAllocationHeaderBytes;
// The most bytes of a portal without its corners in the store: three small
// numbers.
constexpr uint64_t kStoredPortalBytes = 16;

// Unless empty, `read` is told the size of each chunk before the portals of
// that chunk are visited.
void VisitPortals(const BlockStorage& store,
                  uint32_t kind,
                  uint64_t count,
                  const std::function<void(uint64_t)>& read,
                  const std::function<void(Portal&&)>& visit) {
  uint64_t visited = 0;
  for (uint32_t chunk = 0; visited < count; ++chunk) {
    const BlockKey key{BlockKind::kPortals, chunk, kind};
    visited += ReadBlock(store, key, [&](ByteReader& in) {
      if (read) {
        read(in.Remaining());
      }
      if (in.AtEnd()) {
        throw DamagedStoreError("it is empty");
      }
      uint64_t some = 0;
      for (; !in.AtEnd(); ++some) {
        Portal portal;
        portal.front = CellId(static_cast<uint32_t>(in.GetVarint()));
        portal.back = CellId(static_cast<uint32_t>(in.GetVarint()));
        portal.vertices = in.GetArray<Point3>();
        visit(std::move(portal));
      }
      return some;
    });
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

}  // namespace

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

void SaveRegions(const std::vector<CellId>& cell_of_region,
                 const PortalSource& openings,
                 BlockStorage& store) {
  PortalWriter writer(kOpeningBlock, store);
  openings([&](const Portal& opening) { writer.Add(opening); });
  ByteWriter head;
  head.PutVarint(writer.Finish());
  head.PutArray(std::span<const CellId>(cell_of_region));
  store.Put(kRegionKey, head.View());
}

namespace {

struct PartitionHead {
  Partition partition;  // without portals
  uint64_t portals = 0;
};

PartitionHead DecodeHead(ByteReader& head) {
  constexpr uint64_t kLeastCellBytes = sizeof(Box3) + 1 + sizeof(double) + 1;
  PartitionHead decoded;
  Partition& partition = decoded.partition;
  partition.cells.resize(head.GetCount(kLeastCellBytes));
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
  decoded.portals = head.GetVarint();
  partition.notes.resize(head.GetCount(1));
  for (std::string& note : partition.notes) {
    note = head.GetString();
  }
  return decoded;
}

}  // namespace

Partition LoadWithoutPortals(const BlockStorage& store, uint64_t* portals) {
  auto head = ReadPackedMeta(store, kMetaName, DecodeHead);
  if (!head) {
    ThrowDamaged(store, "holds no cells: its partition was never finished");
  }
  if (portals != nullptr) {
    *portals = head->portals;
  }
  return std::move(head->partition);
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
  return ReadBlockIfAny(store, kRegionKey, [](ByteReader& in) {
    in.GetVarint();  // number of openings
    return in.GetArray<CellId>();
  });
}

void ForEachOpening(const BlockStorage& store,
                    const std::function<void(const Portal&)>& visit) {
  const uint64_t openings = ReadBlock(store, kRegionKey, [](ByteReader& in) {
    const uint64_t count = in.GetVarint();
    in.TakeRest();  // the cells of the regions
    return count;
  });
  VisitPortals(store, kOpeningBlock, openings, {}, visit);
}

}  // namespace enfilade
