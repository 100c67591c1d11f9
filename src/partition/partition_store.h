// The partition in the store: its cells in a meta entry, its portals and the
// openings between its convex regions in chunks.

#pragma once

#include "base/block_storage.h"
#include "base/ids.h"
#include "partition/partition.h"

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

namespace enfilade {

// Visits portals one after the other, and the same portals on every call.
using PortalSource =
    std::function<void(const std::function<void(const Portal&)>& visit)>;

void SavePartition(const Partition& partition, BlockStorage& store);

// Saves which cell each convex region belongs to, and the openings between
// regions. `front` and `back` of the openings are region numbers.
void SaveRegions(const std::vector<CellId>& cell_of_region,
                 const PortalSource& openings,
                 BlockStorage& store);

// Loads a partition that BuildPartition has stored, without its portals. Unless
// null, `portals` is set to their number.
Partition LoadWithoutPortals(const BlockStorage& store,
                             uint64_t* portals = nullptr);

// Loads the cells alone.
std::vector<CellInfo> LoadCells(const BlockStorage& store);

// Visits the stored portals in their order. Only one stored chunk of them is in
// memory at a time.
void ForEachPortal(const BlockStorage& store,
                   const std::function<void(const Portal&)>& visit);

// The most bytes that one portal adds to what LoadPartition tells `reserve`.
uint64_t BytesOf(const Portal& portal);

// Loads the partition with its portals, of which there may be many. Before each
// chunk of portals is decoded, `reserve`, unless empty, is told the bytes of
// all portals without their corners plus those of the corners up to that chunk.
Partition LoadPartition(
    const BlockStorage& store,
    const std::function<void(uint64_t bytes)>& reserve = {});

// The cell that each convex region was joined into, in a partition that
// BuildPartition has stored; nullopt if the store has no regions.
std::optional<std::vector<CellId>> LoadRegionCells(const BlockStorage& store);

// Visits every opening between two convex regions, including those inside a
// cell. `front` and `back` of these Portals are region numbers, not cells.
void ForEachOpening(const BlockStorage& store,
                    const std::function<void(const Portal&)>& visit);

}  // namespace enfilade
