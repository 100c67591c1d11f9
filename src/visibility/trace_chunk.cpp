#include "visibility/trace_chunk.h"

#include "base/check.h"
#include "base/morton.h"
#include "base/stop.h"
#include "partition/patch.h"
#include "partition/patch_points.h"
#include "visibility/ray_tracer.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace enfilade {
namespace {

// The Embree scene of a chunk of this size takes about 1.5 MB: small beside the
// least budget, large beside the cost of entering a scene.
constexpr size_t kMaxChunkPatches = 8192;
constexpr double kGridMetres = 0x1p-18;

// A patch on its way into a chunk.
struct PendingPatch {
  Patch patch;
  TracePrimitive id;
};

double OnGrid(double x) {
  return std::round(x / kGridMetres) * kGridMetres;
}

LocalPoint LocalOnGrid(Point3 p, Point3 origin) {
  return {static_cast<float>(OnGrid(p.x) - origin.x),
          static_cast<float>(OnGrid(p.y) - origin.y),
          static_cast<float>(OnGrid(p.z) - origin.z)};
}

Box3 BoundsOf(std::span<const PendingPatch> patches) {
  Box3 box;
  for (const PendingPatch& p : patches) {
    const CornerList<Point3> corners = CornersOf(p.patch);
    box.Include(enfilade::BoundsOf(corners.View()));
  }
  return box;
}

TraceChunk MakeChunk(std::span<const PendingPatch> patches, const Box3& box) {
  TraceChunk chunk;
  const Point3 c = box.Center();
  chunk.origin = {std::round(c.x), std::round(c.y), std::round(c.z)};
  for (const PendingPatch& p : patches) {
    const CornerList<Point3> corners = CornersOf(p.patch);
    const std::span<const Point3> view = corners.View();
    LocalQuad quad{};
    std::transform(view.begin(), view.end(), quad.begin(), [&](Point3 q) {
      return LocalOnGrid(q, chunk.origin);
    });
    if (p.patch.shape == PatchShape::kTriangle) {
      chunk.triangles.push_back({quad[0], quad[1], quad[2]});
      chunk.triangle_ids.push_back(p.id);
    } else {
      chunk.quads.push_back(quad);
      chunk.quad_ids.push_back(p.id);
    }
  }
  return chunk;
}

// Collects patches and writes them as chunks.
class TraceChunkWriter {
 public:
  TraceChunkWriter(BlockStorage& store, MemoryBudget& budget)
      : store_(&store), charge_(budget, "sorting triangles for ray tracing") {
    charge_.GrowTo(2 * kMaxChunkPatches * kBytesPerPatch);
  }

  void AddCell(CellId cell, const CellPatches& content) {
    if (pending_.size() + content.patches.size() > kMaxChunkPatches) {
      Flush(pending_);
      pending_.clear();
    }
    charge_.GrowTo((pending_.size() + content.patches.size()) * kBytesPerPatch);
    for (size_t i = 0; i < content.patches.size(); ++i) {
      pending_.push_back({content.patches[i], {cell, PatchId(i)}});
    }
  }

  void Finish() {
    Flush(pending_);
    ByteWriter writer;
    writer.PutArray(std::span<const TraceChunkInfo>(table_));
    store_->Put({BlockKind::kTrace, 0}, writer.View());
  }

 private:
  static constexpr uint64_t kBytesPerPatch = 2 * sizeof(PendingPatch) + 80;

  // Writes the patches as one chunk. If they are too many, halves them at the
  // median along the longest side and writes each half.
  void Flush(std::span<PendingPatch> patches) {
    if (patches.empty()) {
      return;
    }
    const Box3 box = BoundsOf(patches);
    if (patches.size() <= kMaxChunkPatches) {
      Write(patches, box);
      return;
    }
    const Vec3 e = box.Extent();
    const size_t axis = e.x >= e.y && e.x >= e.z ? 0 : e.y >= e.z ? 1 : 2;
    const auto key = [axis](const PendingPatch& p) {
      return p.patch.origin[axis] + (p.patch.u[axis] + p.patch.v[axis]) / 2;
    };
    std::stable_sort(
        patches.begin(), patches.end(), [&](const auto& a, const auto& b) {
          return key(a) < key(b);
        });
    const size_t half = patches.size() / 2;
    Flush(patches.first(half));
    Flush(patches.subspan(half));
  }

  void Write(std::span<const PendingPatch> patches, const Box3& box) {
    const auto index = static_cast<uint32_t>(table_.size());
    store_->Put({BlockKind::kTrace, 1 + index},
                EncodeTraceChunk(MakeChunk(patches, box)));
    table_.push_back({box, patches.size()});
  }

  BlockStorage* store_;
  GrowingCharge charge_;
  std::vector<PendingPatch> pending_;
  std::vector<TraceChunkInfo> table_;
};

// The cells with patches, in the order of the centers of their patches' boxes
// along the Morton curve.
std::vector<CellId> CellsInSpace(const BlockStorage& store) {
  std::vector<std::pair<CellId, Point3>> centers;
  std::vector<CellId> cells;
  store.ForEachKey(BlockKind::kCellPatches,
                   [&](const BlockKey& key) { cells.emplace_back(key.a); });
  Box3 all;
  for (const CellId id : cells) {
    Box3 box;
    ThrowIfStopRequested();
    for (const Patch& p : LoadCellPatches(store, id).patches) {
      const CornerList<Point3> corners = CornersOf(p);
      box.Include(enfilade::BoundsOf(corners.View()));
    }
    if (!box.IsEmpty()) {
      centers.emplace_back(id, box.Center());
      all.Include(box);
    }
  }
  std::vector<std::pair<uint64_t, CellId>> order;
  order.reserve(centers.size());
  for (const auto& [id, center] : centers) {
    order.emplace_back(MortonCode(center, all), id);
  }
  std::sort(order.begin(), order.end());
  cells.clear();
  for (const auto& [code, id] : order) {
    cells.push_back(id);
  }
  return cells;
}

}  // namespace

Bytes EncodeTraceChunk(const TraceChunk& chunk) {
  ByteWriter writer;
  writer.Put(chunk.origin);
  writer.PutArray(std::span<const LocalQuad>(chunk.quads));
  writer.PutArray(std::span<const LocalTriangle>(chunk.triangles));
  writer.PutArray(std::span<const TracePrimitive>(chunk.quad_ids));
  writer.PutArray(std::span<const TracePrimitive>(chunk.triangle_ids));
  return writer.Take();
}

TraceChunk DecodeTraceChunk(std::span<const std::byte> bytes) {
  ByteReader reader(bytes);
  TraceChunk chunk;
  chunk.origin = reader.Get<Point3>();
  chunk.quads = reader.GetArray<LocalQuad>();
  chunk.triangles = reader.GetArray<LocalTriangle>();
  chunk.quad_ids = reader.GetArray<TracePrimitive>();
  chunk.triangle_ids = reader.GetArray<TracePrimitive>();
  if (chunk.quads.size() != chunk.quad_ids.size() ||
      chunk.triangles.size() != chunk.triangle_ids.size()) {
    throw DamagedStoreError("it contradicts itself");
  }
  reader.RequireEnd();
  return chunk;
}

std::vector<TraceChunkInfo> LoadTraceTable(const BlockStorage& store) {
  return ReadBlock(store, {BlockKind::kTrace, 0}, [](ByteReader& in) {
    return in.GetArray<TraceChunkInfo>();
  });
}

TraceChunk LoadTraceChunk(const BlockStorage& store, size_t index) {
  return ReadBlock(
      store,
      {BlockKind::kTrace, 1 + static_cast<uint32_t>(index)},
      [](ByteReader& in) { return DecodeTraceChunk(in.TakeRest()); });
}

void BuildTraceChunks(BlockStorage& store, MemoryBudget& budget) {
  store.EraseAll(BlockKind::kTrace);
  TraceChunkWriter writer(store, budget);
  for (const CellId cell : CellsInSpace(store)) {
    ThrowIfStopRequested();
    writer.AddCell(cell, LoadCellPatches(store, cell));
  }
  writer.Finish();
}

}  // namespace enfilade
