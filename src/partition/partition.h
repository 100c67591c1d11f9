// Partition: splits the building into cells and portals, clips its faces to the
// cells and cuts them into patches.
//
// A cell is a region of space, convex or not, bounded by opaque faces and
// portals. Every point of the scene's bounding box (a little enlarged) that is
// off every boundary lies in exactly one cell. The outdoors is one cell or
// several; beyond the box is black void. The portals are the open part of the
// boundary between two cells. A portal may be too large, but never too small.

#pragma once

#include "base/block_storage.h"
#include "base/ids.h"
#include "base/memory.h"
#include "base/vec.h"
#include "partition/patch.h"
#include "scene/scene_store.h"

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace enfilade {

// A convex planar opening between two cells, counter-clockwise seen from
// `front`.
struct Portal {
  CellId front;
  CellId back;
  std::vector<Point3> vertices;
};

struct PartitionOptions {
  // A leaf whose faces make more patches than this is cut by artificial walls
  // that are all portal. A cell may end up with up to twice as many patches,
  // because long patches, and patches that others stand on, are cut further.
  // Never derived from the memory cap.
  uint32_t max_cell_patches = 5000;
  // Convex regions that look like one room are joined while the area of their
  // faces is at most this, m2. A corridor through the whole building thus
  // becomes several cells, whose element trees need not be in memory together.
  // Rooms that the input names stay whole.
  double max_room_m2 = 600;
  std::function<void(double fraction)> progress;  // may be empty
};

// What stays in memory of a cell; its patches lie in the store.
struct CellInfo {
  Box3 bounds;
  uint32_t patches = 0;
  double area_m2 = 0;  // of its patches
  // The Space that the cell was made of (gbXML), if any.
  std::optional<SpaceId> space;
};

// Of all cells together.
inline uint64_t PatchCount(std::span<const CellInfo> cells) {
  uint64_t patches = 0;
  for (const CellInfo& cell : cells) {
    patches += cell.patches;
  }
  return patches;
}

// All cells, but not their patches. Those who need no portals load it without
// them (partition_store.h).
struct Partition {
  std::vector<CellInfo> cells;  // indexed by CellId
  std::vector<Portal> portals;  // indexed by PortalId
  // The area, over both sides of the faces, that was there twice and makes no
  // patch (overlap.h).
  double overlap_m2 = 0;
  std::vector<std::string> notes;
};

// Reads the store's scene; writes kCellPatches blocks, kPortals chunks and a
// meta entry. Deterministic: the result depends on scene and options only.
Partition BuildPartition(BlockStorage& store,
                         const PartitionOptions& options,
                         MemoryBudget& budget);

}  // namespace enfilade
