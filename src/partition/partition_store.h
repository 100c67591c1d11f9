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

// Hands out portals, one after the other; the same each time it is called.
using PortalSource =
    std::function<void(const std::function<void(const Portal&)>& visit)>;

void SavePartition(const Partition& partition, BlockStorage& store);

// Saves which cell each convex region belongs to, and the openings between
// regions, whose `front` and `back` count regions.
void SaveRegions(const std::vector<CellId>& cell_of_region,
                 const PortalSource& openings,
                 BlockStorage& store);

// A partition that BuildPartition has stored, without its portals; `portals`,
// unless null, is told how many there are.
Partition LoadWithoutPortals(const BlockStorage& store,
                             uint64_t* portals = nullptr);

// Its cells alone.
std::vector<CellInfo> LoadCells(const BlockStorage& store);

// Visits its portals in their order, of which few are in memory at a time.
void ForEachPortal(const BlockStorage& store,
                   const std::function<void(const Portal&)>& visit);

// What a portal takes among those that are loaded, as `reserve` below is told,
// at most.
uint64_t BytesOf(const Portal& portal);

// All of it. Of portals there may be many: `reserve`, unless empty, is told how
// many bytes they take in all before they are read. So with the openings of
// regions.
Partition LoadPartition(
    const BlockStorage& store,
    const std::function<void(uint64_t bytes)>& reserve = {});

// The cell of each convex region that the cells are joined of, of a partition
// that BuildPartition has stored; nullopt if the store has none.
std::optional<std::vector<CellId>> LoadRegionCells(const BlockStorage& store);

// Every opening between two of these regions, those inside a cell included:
// `front` and `back` of a Portal here count regions.
void ForEachOpening(const BlockStorage& store,
                    const std::function<void(const Portal&)>& visit);

}  // namespace enfilade
