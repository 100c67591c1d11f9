// The patches that emit, and their choice as seen from a point: for sampling
// direct light.
//
// Notation, from a point x
//   w_e        importance of lamp e, a rough bound of what it sends to x
//   P_e / A_e  density of a point on lamp e, chosen by w_e and then by area, in
//              1/m2

#pragma once

#include "base/block_storage.h"
#include "base/ids.h"
#include "base/memory.h"
#include "base/photometry.h"
#include "base/vec.h"
#include "partition/patch.h"
#include "scene/scene_store.h"

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace enfilade {

struct Lamp {
  CellId cell;
  PatchId id;
  Patch patch;
  Vec3 normal;      // unit length
  double area = 0;  // m2
  Rgb exitance{};   // W/m2
};

// All of a building, by cell and patch.
class Lamps {
 public:
  // What so many take while they are found.
  static uint64_t BytesFor(size_t lamps) {
    constexpr uint64_t kGrowth = 3;  // old and new while the array grows
    return kGrowth * lamps * sizeof(Lamp);
  }

  // Reads each cell's patches once.
  Lamps(const BlockStorage& store,
        const SceneInfo& scene,
        size_t cells,
        MemoryBudget& budget);

  // Those of a cell.
  [[nodiscard]] std::span<const Lamp> Of(CellId cell) const;

  // The lamp of this patch, nullptr if it is none.
  [[nodiscard]] const Lamp* Find(CellId cell, PatchId patch) const;

 private:
  std::vector<Lamp> lamps_;
  MemoryCharge charge_;
};

// The lamps of some cells as a point sees them.
class LampChoice {
 public:
  // `cells` ascend; borrowed.
  LampChoice(const Lamps& lamps,
             std::span<const CellId> cells,
             Point3 x,
             Vec3 normal);

  // Nothing can be chosen: no lamp is in front of the point.
  [[nodiscard]] bool IsEmpty() const { return entries_.empty(); }

  // By `s`, uniform in [0, 1). Requires !IsEmpty().
  [[nodiscard]] const Lamp& Choose(double s) const;

  // P_e / A_e; 0 if the lamp cannot be chosen.
  [[nodiscard]] double Density(const Lamp& lamp) const;

 private:
  struct Entry {
    const Lamp* lamp = nullptr;  // ascending
    double sum = 0;              // of the importance up to this one
  };

  std::vector<Entry> entries_;
};

}  // namespace enfilade
