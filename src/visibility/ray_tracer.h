// Closest hits over the whole building under the memory budget, without
// partition or portals: triangles in spatial chunks (BlockKind::kTrace), one
// chunk's Embree scene in memory at a time or as many as the budget holds.
// Rays come in batches; each chunk sees the rays that cross its box and have
// not hit nearer. Independent of cells, so that audits and Monte Carlo
// references can contradict them.
//
// Positions are exact to about 1e-5 m. A ray that leaves a surface should start
// kRayOffsetMetres off it, on the side it leaves.

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

struct TraceRay {
  Point3 origin;
  Vec3 direction;  // need not be normalised; distances are in its lengths
  double max_distance = 1e30;
};

// The nearest patch side that a ray meets, on the patch's own front or on its
// back.
struct TraceHit {
  bool hit = false;
  double distance = 0;
  CellId cell;    // of the patch
  PatchId patch;  // within the cell
  double a = 0;   // patch coordinates of the hit (patch.h)
  double b = 0;
  // Hit on the front, the side that the normal points to. False: no front lies
  // there, the ray came from behind.
  bool on_front = true;
};

// Sorts the triangles of all cells' patches into chunks; after BuildPartition.
void BuildTraceChunks(BlockStorage& store, MemoryBudget& budget);

class RayTracer {
 public:
  RayTracer(const BlockStorage& store, MemoryBudget& budget);
  ~RayTracer();
  RayTracer(const RayTracer&) = delete;
  RayTracer& operator=(const RayTracer&) = delete;

  // hits.size() == rays.size(). Where two sides of one wall lie at the same
  // distance, the one whose front faces the ray is returned. Traces in
  // parallel; to be called from one thread at a time. Equal bits whatever the
  // budget and the threads. Takes up to half of what the budget had left at
  // construction; DoesNotFitError when that does not hold one chunk (2 MiB).
  void Trace(std::span<const TraceRay> rays, std::span<TraceHit> hits);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace enfilade
