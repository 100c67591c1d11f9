// The surfaces that rays hit, read from the cells' patches in batches.

#pragma once

#include "base/memory.h"

#include <cstdint>
#include <list>
#include <span>
#include <unordered_map>

#include "tools/building_view.h"

namespace enfilade {

// What light does at a hit.
struct Surface {
  bool hit = false;    // false: the void; nothing else is set
  bool front = false;  // the ray met the patch's front; else its black back
  Point3 position;     // on the patch, in double precision
  Vec3 normal;         // of the patch, unit length
  double raised = 0;   // how far before its place in the scene it lies, m
  Rgb reflectance{};   // zero if the side does not reflect
  Rgb exitance{};      // zero if the side does not emit
};

// Reads every cell at most once per call and keeps the latest ones decoded.
class SurfaceReader {
 public:
  // Charges `cache_bytes` at once. If a single cell is larger than that, the
  // excess is charged as long as the cell is held.
  SurfaceReader(const BuildingView& view,
                MemoryBudget& budget,
                uint64_t cache_bytes);

  // All three spans of the same size; surfaces[i] is what rays[i] hit.
  void Read(std::span<const TraceRay> rays,
            std::span<const TraceHit> hits,
            std::span<Surface> surfaces);

  // The patches of one cell, valid until the next call.
  const std::vector<Patch>& Patches(CellId cell);

 private:
  struct Entry {
    CellId cell;
    std::vector<Patch> patches;
    uint64_t bytes = 0;
    MemoryCharge excess;
  };

  void EvictUntilFits(uint64_t bytes);

  const BuildingView* view_;
  MemoryBudget* budget_;
  uint64_t cache_bytes_;
  uint64_t held_bytes_ = 0;
  MemoryCharge charge_;
  std::list<Entry> entries_;  // most recently used first
  std::unordered_map<CellId, std::list<Entry>::iterator> by_cell_;
  std::vector<uint32_t> order_;
};

}  // namespace enfilade
