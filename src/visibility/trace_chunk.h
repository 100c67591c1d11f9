// Trace chunks: the patches of a few neighbouring cells as vertices for the
// tracer, one block each, and the table of their boxes. Internal to
// src/visibility. Blocks: kTrace 0 is the table, kTrace 1 + i is chunk i.

#pragma once

#include "base/block_storage.h"
#include "base/ids.h"
#include "base/packed.h"
#include "base/vec.h"
#include "visibility/embree.h"

#include <cstdint>
#include <vector>

namespace enfilade {

// The patch that a primitive stands for.
struct TracePrimitive {
  CellId cell;
  PatchId patch;
};

// Vertices are rounded to the world's grid of 2^-18 m (4 micrometres) and given
// relative to `origin`, whose coordinates are whole metres: in chunks up to
// 64 m wide floats hold them exactly, so that a vertex is the same point in
// every chunk and no crack opens between chunks.
struct TraceChunk {
  Point3 origin;
  std::vector<LocalQuad> quads;
  std::vector<LocalTriangle> triangles;
  std::vector<TracePrimitive> quad_ids;      // parallel to quads
  std::vector<TracePrimitive> triangle_ids;  // parallel to triangles
};

// The part of a chunk's description that stays in memory.
struct TraceChunkInfo {
  Box3 bounds;
  uint64_t primitives = 0;
};

template <>
inline constexpr bool kIsPacked<TraceChunkInfo> = kIsPacked<Box3> &&
                                                  sizeof(TraceChunkInfo) ==
                                                      sizeof(Box3) +
                                                          sizeof(uint64_t);

Bytes EncodeTraceChunk(const TraceChunk& chunk);
TraceChunk DecodeTraceChunk(std::span<const std::byte> bytes);

std::vector<TraceChunkInfo> LoadTraceTable(const BlockStorage& store);
TraceChunk LoadTraceChunk(const BlockStorage& store, size_t index);

}  // namespace enfilade
