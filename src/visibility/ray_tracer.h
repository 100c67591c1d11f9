// Closest hits over the whole building under the memory budget, without
// partition or portals. The triangles are in spatial chunks
// (BlockKind::kTrace); as many chunks as the budget holds, at least one, have
// their Embree scene in memory at a time. Rays come in batches, and each chunk
// sees the rays that cross its box and have no nearer hit. The tracer does not
// depend on cells, so that audits and Monte Carlo references can contradict
// them.
//
// Positions are exact to about 1e-5 m where a chunk is less than 64 m wide, and
// to a float's step of its width elsewhere (trace_chunk.h). A ray that leaves a
// surface should start kRayOffsetMetres off the surface, or RayOffset(), on the
// side that the ray leaves from.

#pragma once

#include "base/block_storage.h"
#include "base/ids.h"
#include "base/memory.h"
#include "base/vec.h"

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace enfilade {

constexpr double kRayOffsetMetres = 1e-4;

// How far off the surface they leave rays should start that sample light, m:
// well above the rounding of positions in a scene of these bounds, and, up to
// 4 km, below the distance kApartM by which one of two surfaces in one place
// stands before the other. From the hidden one rays must not start in front of
// both.
double RayOffset(const Box3& scene_bounds);

struct TraceRay {
  Point3 origin;
  // Need not be normalised; distances are in units of its length.
  Vec3 direction;
  double max_distance = 1e30;
};

// The nearest hit of a ray on a patch, on the patch's front or on its back.
struct TraceHit {
  bool hit = false;
  double distance = 0;
  CellId cell;    // of the patch
  PatchId patch;  // within the cell
  double a = 0;   // patch coordinates of the hit (patch.h)
  double b = 0;
  // The ray hit the front, the side that the normal points to. If false, no
  // front lies there and the ray came from behind.
  bool on_front = true;
};

// Sorts the triangles of all cells' patches into chunks. To be called after
// BuildPartition.
void BuildTraceChunks(BlockStorage& store, MemoryBudget& budget);

class RayTracer {
 public:
  RayTracer(const BlockStorage& store, MemoryBudget& budget);
  ~RayTracer();
  RayTracer(const RayTracer&) = delete;
  RayTracer& operator=(const RayTracer&) = delete;

  // Requires hits.size() == rays.size(). Where two sides of one wall lie at the
  // same distance, the hit is on the one whose front faces the ray. Traces in
  // parallel, but must be called from one thread at a time. The result is the
  // same to the bit for every budget and number of threads. Takes up to half of
  // what the budget had left at construction; throws DoesNotFitError if the
  // budget does not hold one chunk (2 MiB).
  void Trace(std::span<const TraceRay> rays, std::span<TraceHit> hits);

  // In how many parts of equal size the building should be traced, so that the
  // chunks that the rays of a part meet are in memory together: 1 if all chunks
  // are. Rays that start here and there load all chunks in every call.
  [[nodiscard]] size_t Parts() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace enfilade
