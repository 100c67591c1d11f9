// The patches that emit (lamps), and the choice of a lamp from a point, for
// sampling direct light.
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

// All lamps of a building, in the order of cells and patches.
class Lamps {
 public:
  // The bytes that so many lamps take while they are found.
  static uint64_t BytesFor(size_t lamps) {
    constexpr uint64_t kGrowth = 3;  // old and new while the array grows
    return kGrowth * lamps * sizeof(Lamp);
  }

  // Reads each cell's patches once. Charges the lamps, and a LampChoice among
  // all of them for each thread.
  Lamps(const BlockStorage& store,
        const SceneInfo& scene,
        size_t cells,
        MemoryBudget& budget);

  // The lamps of a cell.
  [[nodiscard]] std::span<const Lamp> Of(CellId cell) const;

  // The lamp of this patch, nullptr if the patch does not emit.
  [[nodiscard]] const Lamp* Find(CellId cell, PatchId patch) const;

 private:
  std::vector<Lamp> lamps_;
  MemoryCharge charge_;
};

// The choice among the lamps of some cells by their importance for a point.
class LampChoice {
 public:
  // The bytes that a choice takes for each lamp of its cells.
  static constexpr uint64_t kBytesPerLamp = 16;

  // `cells` are in ascending order; they are borrowed.
  LampChoice(const Lamps& lamps,
             std::span<const CellId> cells,
             Point3 x,
             Vec3 normal);

  // Whether no lamp can be chosen, since none is in front of the point.
  [[nodiscard]] bool IsEmpty() const { return entries_.empty(); }

  // Chooses a lamp by `s`, uniform in [0, 1). Requires !IsEmpty().
  [[nodiscard]] const Lamp& Choose(double s) const;

  // P_e / A_e; 0 if the lamp cannot be chosen.
  [[nodiscard]] double Density(const Lamp& lamp) const;

 private:
  struct Entry {
    const Lamp* lamp = nullptr;  // ascending
    double sum = 0;              // of the importances up to this one's
  };

  static_assert(sizeof(Entry) == kBytesPerLamp);

  std::vector<Entry> entries_;
};

}  // namespace enfilade
