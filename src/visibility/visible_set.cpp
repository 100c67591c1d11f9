#include "visibility/visible_set.h"

#include "base/error.h"
#include "base/parallel.h"
#include "visibility/beam_flood.h"
#include "visibility/cell_explorer.h"
#include "visibility/portal_graph.h"
#include "visibility/set_agreement.h"

#include <algorithm>
#include <optional>
#include <sstream>
#include <string_view>

#include <fmt/format.h>

namespace enfilade {
namespace {

constexpr const char* kSummaryMeta = "visibility";
constexpr size_t kMostExploredAtOnce = 8;  // cells
constexpr std::string_view kDoorways = "the doorways of the building";

// Without regions in the store every cell is one. What it takes is charged.
RegionGraph RegionGraphOf(const Partition& partition,
                          const BlockStorage& store,
                          GrowingCharge* charge) {
  const size_t cells = partition.cells.size();
  uint64_t openings_bytes = 0;
  std::optional<Regions> regions = LoadRegions(store, [&](uint64_t bytes) {
    openings_bytes = bytes;
    charge->GrowTo(bytes, kShareOfPortals);
  });
  if (!regions) {
    regions.emplace();
    for (size_t i = 0; i < cells; ++i) {
      regions->cell_of.emplace_back(i);
    }
    regions->openings = partition.portals;
  }
  charge->GrowTo(
      openings_bytes +
          PortalGraph::MostBytes(regions->cell_of.size(), regions->openings),
      0.5);  // the cells' is to come
  RegionGraph graph(cells, *regions);
  charge->ShrinkTo(graph.Graph().SizeBytes());
  return graph;
}

// What exploring a cell may take in memory.
uint64_t ExplorationBytes(size_t cells,
                          const RegionGraph& regions,
                          uint32_t max_steps) {
  return BeamFlood::MostBytes(regions) + ReachedParts::BytesFor(cells) +
         BytesToNoteSeen(cells, max_steps);
}

// How many cells are explored side by side: what comes of it is the same.
size_t CellsAtOnce(uint64_t bytes_each, const MemoryBudget& budget) {
  return std::clamp<uint64_t>(
      budget.FreeBytes() / 2 / std::max<uint64_t>(bytes_each, 1),
      1,
      kMostExploredAtOnce);
}

// Explores all cells, in parallel batches; counts cells with spent budgets.
uint64_t ExploreAll(const Partition& partition,
                    const RegionGraph& regions,
                    const VisibilityOptions& options,
                    MemoryBudget& budget,
                    SetAgreement& sets) {
  const size_t count = partition.cells.size();
  MemoryCharge of_graph(
      budget, PortalGraph::MostBytes(count, partition.portals), kDoorways);
  const PortalGraph graph(count, partition.portals);
  of_graph.ShrinkTo(graph.SizeBytes());
  const uint64_t bytes_each =
      ExplorationBytes(count, regions, options.max_steps_per_cell);
  const size_t at_once = CellsAtOnce(bytes_each, budget);
  const MemoryCharge of_floods(
      budget, at_once * bytes_each, "looking through the doorways");
  uint64_t spent = 0;
  for (size_t first = 0; first < count; first += at_once) {
    std::vector<Exploration> batch(std::min(at_once, count - first));
    ParallelFor(batch.size(), [&](size_t i) {
      batch[i] = ExploreFrom(CellId(first + i),
                             partition,
                             graph,
                             regions,
                             options.max_steps_per_cell,
                             budget);
    });
    // What floods have freed is still resident, and the pager is not here to
    // look at that.
    if (budget.ResidentExcess() > 0) {
      ReleaseFreedMemory();
    }
    for (size_t i = 0; i < batch.size(); ++i) {
      sets.Put(CellId(first + i), batch[i].seen);
      if (batch[i].budget_spent) {
        ++spent;
      }
    }
    if (options.progress) {
      options.progress(0.9 * static_cast<double>(first + batch.size()) /
                       static_cast<double>(count));
    }
  }
  return spent;
}

}  // namespace

VisibilitySummary BuildVisibleSets(const Partition& partition,
                                   const VisibilityOptions& options,
                                   MemoryBudget& budget,
                                   BlockStorage& store) {
  store.EraseAll(BlockKind::kVisibleSet);
  store.EraseAll(BlockKind::kScratch);
  VisibilitySummary summary;
  SetAgreement sets(partition, budget, store);
  {
    GrowingCharge of_regions(budget, kDoorways);
    summary.budget_spent_cells =
        ExploreAll(partition,
                   RegionGraphOf(partition, store, &of_regions),
                   options,
                   budget,
                   sets);
  }
  sets.Agree();
  for (size_t i = 0; i < partition.cells.size(); ++i) {
    summary.visible_pairs += sets.Finish(CellId(i));
  }
  store.EraseAll(BlockKind::kScratch);
  store.SetMeta(
      kSummaryMeta,
      fmt::format("{} {}", summary.visible_pairs, summary.budget_spent_cells));
  if (options.progress) {
    options.progress(1);
  }
  return summary;
}

VisibilitySummary LoadVisibilitySummary(const BlockStorage& store) {
  std::istringstream text(store.Meta(kSummaryMeta).value_or(""));
  VisibilitySummary summary;
  if (!(text >> summary.visible_pairs >> summary.budget_spent_cells)) {
    throw DamagedStoreError("the store holds no visible sets");
  }
  return summary;
}

uint64_t BytesOf(const VisibleSet& set) {
  size_t between = 0;
  for (const VisibleCell& visible : set) {
    between += visible.between.size();
  }
  return VisibleSetBytes(set.size(), between);
}

uint64_t VisibleSetBytes(size_t sources, size_t between) {
  return sources * (sizeof(VisibleCell) + kAllocationHeaderBytes) +
         between * sizeof(CellId);
}

VisibleSet LoadVisibleSet(const BlockStorage& store,
                          CellId receiver,
                          const std::function<void(uint64_t)>& reserve) {
  return DecodeVisibleSet(
      store.GetOrThrow({BlockKind::kVisibleSet, receiver.value}), reserve);
}

}  // namespace enfilade
